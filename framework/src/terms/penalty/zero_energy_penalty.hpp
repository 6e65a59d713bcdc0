#pragma once
/// Force and energy of a stabilization (see perikit/model/stabilization.hpp) on one body. With V_i contained in M_i from here on:
///
///   E = 1/2 sum_i sum_j V_j omega_ij z_ij . M_i z_ij,   z_ij = u_ij - H_i xi_ij
///   f_k = sum_j omega_kj [(V_j M_k + V_k M_j) u_kj - (V_j M_k H_k + V_k M_j H_j) xi_kj]   (order 1)
///
/// (z_jk = -(u_kj - H_j xi_kj).) E is quadratic: d2E/du2 w = -f(w). At higher orders the gradient's own share remains: see
/// stencil_penalty.cpp.

#include "terms/penalty/penalty_element.hpp"
#include "terms/term.hpp"

namespace perikit {

class ZeroEnergyPenalty : public Term {
 public:
  std::int64_t add_forces(ConstFieldView u, FieldView force, ExactSum* energy) final;
  std::int64_t add_tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) final;
  std::int64_t add_samples(ConstFieldView u, PointSamples& samples) final;
  std::int64_t add_forces_of(ConstFieldView u, const GroupMarks& only, const GroupMarks& near, FieldView force, ExactSum* energy) final {
    std::vector<double> energies;
    apply(u, 1.0, force, {energy ? &energies : nullptr}, only.data(), near.data());
    if (energy) add_owned(parts_.families.body(), energies, *energy);
    return -1;
  }
  std::int64_t renew_forces(ConstFieldView u, const GroupMarks& only, const GroupMarks& complete, const GroupMarks& near, FieldView force, ExactSum& energy) final {
    std::vector<double> renewed;
    apply(u, 1.0, force, {&renewed}, only.data(), near.data());
    replace(complete, renewed, energies_);
    add_owned(parts_.families.body(), energies_, energy);
    return -1;
  }
  std::int64_t add_tangent_of(ConstFieldView, ConstFieldView w, const GroupMarks& only, const GroupMarks& near, FieldView Kw) final {
    apply(w, -1.0, Kw, {}, only.data(), near.data());
    return -1;
  }
  void add_bonds(ConstFieldView u, const GroupMarks& marks, const GroupMarks& near, BondSamples& samples) final;
  int coupling_reach() const noexcept final { return 2; }
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) const final;
  const NearestFailure* watch(const BodyDamage&) final { return nullptr; }
  bool screen(BondScreen* screen) final {
    screen_ = screen;
    return true;
  }
  void report(ModelReport& report) const final;
  RestingCounts resting_counts() const noexcept final { return {}; }  // counted with the gradients

 protected:
  explicit ZeroEnergyPenalty(const PenaltyParts& parts) : parts_(parts) {}
  /// What is wanted beside forces.
  struct Wanted {
    std::vector<double>* energies = nullptr;   ///< E by group of eight points [J]
    BondScreen* screen = nullptr;              ///< groups with a point that holds too much are marked
    bool any() const noexcept { return energies || screen; }
  };
  /// force += -factor dE/du [N]. only, near: what add_forces_of says; null: all.
  virtual void apply(ConstFieldView u, double factor, FieldView force, Wanted wanted, const std::uint8_t* only = nullptr,
                     const std::uint8_t* near = nullptr) = 0;
  /// Takes the energy of point p.
  void take(std::size_t p, double energy, const Wanted& wanted) const;
  /// density[p] += energy of point p per volume [J/m^3]. only: by group of eight points, where it is needed; null: everywhere.
  virtual void add_density(ConstFieldView u, double* density, const std::uint8_t* only = nullptr) = 0;
  virtual std::size_t bytes() const noexcept = 0;

  PenaltyParts parts_;

 private:
  std::vector<double> energies_;  ///< of the last forces with an energy
  BondScreen* screen_ = nullptr;
};

/// Over the point gradient of a body.
std::unique_ptr<Term> make_penalty(const PenaltyParts& parts);

/// Over a point gradient of order 1, on lattices and clouds, and of any order.
template <int D>
std::unique_ptr<Term> make_lattice_penalty(const PenaltyParts& parts);
template <int D>
std::unique_ptr<Term> make_cloud_penalty(const PenaltyParts& parts);
template <int D>
std::unique_ptr<Term> make_stencil_penalty(const PenaltyParts& parts);

}  // namespace perikit
