#pragma once
/// Force and energy of a stabilization (see perikit/model/stabilization.hpp) on one body. With V_i contained in M_i from here on:
///
///   E = 1/2 sum_i sum_j V_j omega_ij z_ij . M_i z_ij,   z_ij = u_ij - H_i xi_ij
///   f_k = sum_j omega_kj [(V_j M_k + V_k M_j) u_kj - (V_j M_k H_k + V_k M_j H_j) xi_kj]   (order 1)
///
/// (z_jk = -(u_kj - H_j xi_kj).) E is quadratic: d2E/du2 w = -f(w). At higher orders z is what the whole fit leaves, or what its linear
/// part does, where the gradient's own share remains in the forces: see stencil_penalty.cpp.

#include "terms/penalty/penalty_element.hpp"
#include "terms/term.hpp"

namespace perikit {

class ZeroEnergyPenalty : public Term, public AssembledTerm, public SampledTerm, public BreakableTerm {
 public:
  std::int64_t forces(const Configuration& at, const Region& region, const ForceSum& sum) final {
    apply(at.u(), 1.0, sum.force, region, {sum.wants_stored() ? sum.energies.data() : nullptr, sum.screen});
    return -1;
  }
  std::int64_t tangent(const Configuration&, ConstFieldView w, const Region& region, FieldView Kw) final {
    apply(w, -1.0, Kw, region, {});
    return -1;
  }
  void report(ModelReport& report) const final;
  bool constant_tangent() const noexcept final { return true; }
  AssembledTerm* assembled() noexcept final { return this; }
  SampledTerm* sampled() noexcept final { return this; }
  BreakableTerm* breakable() noexcept final { return this; }

  int coupling_reach() const noexcept final { return 2; }
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) final;
  std::int64_t sample(const Configuration& at, PointSamples& samples) final {
    add_density(at.u(), samples.strain_energy_density.data());
    return -1;
  }
  std::int64_t forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) final {
    forces(at, {}, sum);
    return sample(at, samples);
  }
  void add_bonds(const Configuration& at, const Region& region, BondSamples& samples) final;

 protected:
  explicit ZeroEnergyPenalty(const PenaltyParts& parts) : parts_(parts) {}
  /// What is wanted beside forces.
  struct Wanted {
    GroupEnergy* energies = nullptr;   ///< += E by group of eight points [J]
    BondScreen* screen = nullptr;              ///< groups with a point that holds too much are marked
    bool any() const noexcept { return energies || screen; }
  };
  /// force += -factor dE/du [N].
  virtual void apply(ConstFieldView u, double factor, FieldView force, const Region& region, Wanted wanted) = 0;
  /// Takes the energy of point p.
  void take(std::size_t p, double energy, const Wanted& wanted) const;
  /// density[p] += energy of point p per volume [J/m^3]. only: by group of eight points, where it is needed; null: everywhere.
  virtual void add_density(ConstFieldView u, double* density, const std::uint8_t* only = nullptr) = 0;
  virtual std::size_t bytes() const noexcept = 0;

  PenaltyParts parts_;
};

/// Over the point gradient of a body.
std::unique_ptr<Term> make_penalty(const PenaltyParts& parts);

/// Over a point gradient of order 1, on lattices and clouds, of what the whole fit of any order leaves on lattices, and of any order.
template <int D>
std::unique_ptr<Term> make_lattice_penalty(const PenaltyParts& parts);
template <int D>
std::unique_ptr<Term> make_cloud_penalty(const PenaltyParts& parts);
template <int D>
std::unique_ptr<Term> make_lattice_fit_penalty(const PenaltyParts& parts);
template <int D>
std::unique_ptr<Term> make_stencil_penalty(const PenaltyParts& parts);

}  // namespace perikit
