#pragma once
#include <vector>

#include "body/interfaces.hpp"
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
};

/// Any pair law on any body: one loop over bonds, or two where the law has a dilatation.
template <int D>
class PairForces final : public Term {
 public:
  explicit PairForces(const PairParts& parts);

  std::int64_t add_forces(ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, nullptr, nullptr);
  }
  std::int64_t add_forces_meanwhile(Arrival& arrival, ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, &arrival, nullptr);
  }
  std::int64_t move_and_add_forces(PointMotion& motion, ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, nullptr, &motion);
  }
  std::int64_t add_tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override {
    return tangent_of(u, w, Kw, nullptr, nullptr);
  }
  /// strain_energy_density, and P where it is asked for.
  std::int64_t add_samples(ConstFieldView u, PointSamples& samples) override;
  int coupling_reach() const noexcept override { return formulation_.dilatation ? 2 : 1; }
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) const override;
  std::int64_t add_forces_of(ConstFieldView u, const GroupMarks& only, const GroupMarks& near, FieldView force,
                             ExactSum* energy) override;
  std::int64_t renew_forces(ConstFieldView u, const GroupMarks& only, const GroupMarks& complete, const GroupMarks& near, FieldView force,
                            ExactSum& energy) override;
  std::int64_t add_tangent_of(ConstFieldView u, ConstFieldView w, const GroupMarks& only, const GroupMarks& near,
                              FieldView Kw) override {
    return tangent_of(u, w, Kw, only.data(), near.data());
  }
  void add_bonds(ConstFieldView u, const GroupMarks& marks, const GroupMarks& near, BondSamples& samples) override;
  void bonds_changed(std::span<const std::int32_t> points) override;
  const NearestFailure* watch(const BodyDamage& damage) override;
  bool screen(BondScreen* screen) override {
    screen_ = screen;
    return true;
  }
  void report(ModelReport& report) const override;
  RestingCounts resting_counts() const noexcept override { return loop_->resting_counts(); }

 private:
  /// The bonds of one point that are left.
  struct Bonds {
    FamilyArrays family;
    AlignedVector<double> extension, modulus, omega;  ///< omega: of the whole bond
    AlignedVector<double> energy, force;
  };
  std::int64_t forces(ConstFieldView u, FieldView force, ExactSum* energy, Arrival* arrival, PointMotion* motion);
  std::int64_t tangent_of(ConstFieldView u, ConstFieldView w, FieldView Kw, const std::uint8_t* only, const std::uint8_t* near);
  /// energies: those of the groups in `only` [J]; null: not wanted.
  std::int64_t forces_of(ConstFieldView u, const GroupMarks& only, const GroupMarks& near, FieldView force, std::vector<double>* energies);
  void load_bonds(std::size_t p, ConstFieldView u, Bonds& bonds) const;
  /// P_i = sum_j b V_j (w'/2 + omega |xi| q_i) n (x) xi: the derivative of the energy density of a point by a homogeneous deformation.
  void add_virial(ConstFieldView u, FieldView P) const;
  /// Moduli of points with the same family, loaded without cuts.
  void set_moduli(const FamilyArrays& family, std::span<const std::int32_t> points, Field& modulus);
  void warn(const PairPoint& point, const MaterialRecord& record);
  void set_sides();
  void renew_sides();
  PairPoint point(std::size_t p) const;
  /// Dilatation of u -> theta_, q_ = phi' d/m; along w -> rate_ = phi'' dtheta d/m; energies += V phi by group of eight points;
  /// phi by point -> density. only, arrival, motion: see PairPass; null for all. local: PairPass::local, and the points whose energies are added.
  std::int64_t dilatation(ConstFieldView u, ConstFieldView w, double* energies, double* density,
                          const std::uint8_t* only = nullptr, const std::uint8_t* local = nullptr, Arrival* arrival = nullptr, PointMotion* motion = nullptr);

  const Families& families_;
  const Body& body_;
  const Laws& laws_;
  std::shared_ptr<const Interfaces> interfaces_;
  const Formulation& formulation_;
  const PairKinematics& law_;
  bool share_;
  PairFields fields_;
  std::unique_ptr<PairLoop> loop_;
  Field scale_;                  ///< d/m_i; 0 without bonds
  Field dilatation_modulus_;     ///< k_i
  Field theta_, q_, rate_;
  Field by_theta_;  ///< phi/theta d/m, where bonds are screened
  BondScreen* screen_ = nullptr;
  Field density_;  ///< work field
  std::vector<double> energies_;  ///< by group of eight points, of the last forces with an energy
  std::vector<const MaterialRecord*> warned_;
  std::vector<std::string> warnings_;
};

std::unique_ptr<Term> make_pair_forces(const PairParts& parts);

}  // namespace perikit
