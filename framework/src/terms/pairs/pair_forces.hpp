#pragma once
#include <array>
#include <vector>

#include "body/interfaces.hpp"
#include "perikit/body/images.hpp"
#include "terms/pairs/pair_loop.hpp"
#include "terms/term.hpp"

namespace perikit {

/// What pair forces are made of. All but the kinematics must outlive them.
struct PairParts {
  const Families& families;
  const Formulation& formulation;
  const Laws& laws;
  bool skip = true, share = true;
  std::shared_ptr<const Interfaces> interfaces;   ///< across these bonds are springs in series; null: nowhere
  std::shared_ptr<const Images> images;           ///< of points of the body; null: none
  std::shared_ptr<const BondFactors> factors;     ///< of the bonds; never null
};

/// Any pair law on any body: one loop over bonds, or two where the law has a dilatation.
template <int D>
class PairForces final : public Term, public AssembledTerm, public SampledTerm, public BreakableTerm {
 public:
  explicit PairForces(const PairParts& parts);

  std::int64_t forces(const Configuration& at, const Region& region, const ForceSum& sum) override;
  std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) override;
  void report(ModelReport& report) const override;
  std::string_view inadmissible() const noexcept override { return "a bond of zero or non-finite length"; }
  AssembledTerm* assembled() noexcept override { return this; }
  SampledTerm* sampled() noexcept override { return this; }
  BreakableTerm* breakable() noexcept override { return this; }

  int coupling_reach() const noexcept override { return formulation_.dilatation ? 2 : 1; }
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) override;
  std::int64_t sample(const Configuration& at, PointSamples& samples) override;
  std::int64_t forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) override {
    const std::int64_t bad = forces(at, {}, sum);
    return bad < 0 ? sample(at, samples) : bad;
  }
  void bonds_changed(std::span<const std::int32_t> points) override;
  void add_bonds(const Configuration& at, const Region& region, BondSamples& samples) override;
  const NearestFailure* watch(double least_onset) override { return loop_->watch(least_onset); }

 private:
  /// The bonds of one point that are left.
  struct Bonds {
    FamilyArrays family;
    AlignedVector<double> extension, modulus, omega;  ///< omega: of the whole bond
    AlignedVector<double> factor;                     ///< of its dilatation
    AlignedVector<double> energy, force;
  };
  void load_bonds(std::size_t p, ConstFieldView u, Bonds& bonds) const;
  /// Poisson's ratio that the law has at a point: of springs alone the one that springs have, else that of the material.
  double poisson(std::size_t p) const noexcept;
  /// What is asked for of
  ///   P_i = sum_j b V_j t_ij (x) xi,  t_ij = (w'/2 + omega |xi| q_i) n: the derivative of the energy density of a point by a homogeneous deformation,
  ///   F_i: the least-squares gradient over the bonds that are left, I where they span no volume,
  ///   sigma_i = sum_j b V_j t_ij (x) y/J, y the deformed bond and J = det F_i: P F^T/J where the deformation is homogeneous, and symmetric everywhere.
  /// In strain spaces stresses across the body follow from Poisson's ratio; in stress spaces F across it does, with logarithmic strains. J is 1 where
  /// det F_i is not positive. Points that store nothing have none.
  void add_tensors(ConstFieldView u, PointSamples& samples) const;
  /// Moduli of points with the same family, loaded without cuts.
  void set_moduli(const FamilyArrays& family, std::span<const std::int32_t> points, Field& modulus);
  void warn(const PairPoint& point, const MaterialRecord& record);
  void set_sides();
  void renew_sides();
  /// Images store nothing, so that a bond to one has half of its modulus: its copy, from the image of this end to the source of the far one, has the
  /// rest. The two together store the energy of one bond. Point by point each is a whole bond of which either end has one half, as in a body that
  /// goes on beyond its side. whole: bonds are such from now on; else they are as forces want them again.
  void show_bonds_to_images(bool whole);
  PairPoint point(std::size_t p) const;
  /// Dilatation of u -> theta_, q_ = phi' d/m; along w -> rate_ = phi'' dtheta d/m. The dilatations of a region are those of its `gradients`, the energies
  /// those of `evaluated`. energies += V phi by group of eight points; phi by point -> density, phi/theta d/m ->
  /// by_theta; null: not wanted.
  std::int64_t dilatation(const Configuration& at, ConstFieldView w, const Region& region, GroupEnergy* energies, double* density,
                           double* by_theta = nullptr);

  const Families& families_;
  const Body& body_;
  const Laws& laws_;
  std::shared_ptr<const Interfaces> interfaces_;
  std::vector<std::array<std::int32_t, 2>> images_;   ///< internal indices of images and their sources
  const Formulation& formulation_;
  const PairKinematics& law_;
  bool share_;
  std::shared_ptr<const BondFactors> factors_;
  PairFields fields_;
  std::unique_ptr<PairLoop> loop_;
  Field scale_;                  ///< d/m_i; 0 without bonds
  Field dilatation_modulus_;     ///< k_i
  Field theta_, q_, rate_;
  Field by_theta_;  ///< phi/theta d/m, where bonds are screened
  Field density_;  ///< work field
  std::vector<const MaterialRecord*> warned_;
  std::vector<std::string> warnings_;
};

std::unique_ptr<Term> make_pair_forces(const PairParts& parts);

}  // namespace perikit
