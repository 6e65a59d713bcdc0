#pragma once
#include <optional>

#include "terms/pair_loop.hpp"
#include "assembly/assembly.hpp"

namespace perikit {

/// Any pair law on any body: one loop over bonds, or two where the law has a dilatation.
template <int D>
class PairModel final : public AssemblingModel {
 public:
  explicit PairModel(const ModelParts& parts);

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  /// strain_energy_density only.
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override;
  bool has_gradients() const noexcept override { return false; }
  Field shape_tensor_condition() override { return body_.make_field(1); }
  Field damage() override { return damage_; }
  ModelReport report() const override;
  QuietCounts quiet_counts() const override { return loop_->quiet_counts(); }

 private:
  std::unique_ptr<Assembly> make_assembly(const ModelParts& parts) const override;
  void set_moduli();
  /// Moduli and damage of points with the same family; false where it has no intact bond.
  bool set_moduli_of(const std::vector<FamilyBond>& bonds, const std::vector<std::int32_t>& points, Field& modulus);
  std::vector<BondChange> bonds_changed(std::span<const std::int32_t> points) override;
  /// Half of each bond of the marked groups, and their dilatation.
  double energy_of(ConstFieldView u, const GroupMarks& marks) override;
  void set_correction(const InfluenceFunction& influence);
  PairPoint point(std::size_t p) const;
  /// Dilatation of u -> theta_, q_ = phi' d/m; along w -> rate_ = phi'' dtheta d/m; V phi by block -> energies; phi by point -> density.
  /// only: groups of points to do, null for all.
  EvaluationStatus dilatation(ConstFieldView u, ConstFieldView w, std::vector<double>* energies, double* density, const std::uint8_t* only = nullptr);

  const Body& body_;
  const Laws& laws_;
  Formulation formulation_;
  const PairKinematics& law_;
  bool share_;
  PairFields fields_;
  std::unique_ptr<PairLoop> loop_;
  Field damage_;
  Field scale_;                  ///< d/m_i; 0 without bonds
  Field dilatation_modulus_;     ///< k_i
  Field theta_, q_, rate_;
  std::size_t lone_ = 0;         ///< points without bonds at the set-up
  std::vector<const MaterialRecord*> warned_;
  std::vector<std::string> warnings_;
  Field density_;                ///< work field of energy_of
};

}  // namespace perikit
