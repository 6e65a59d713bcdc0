#pragma once
#include <memory>
#include <optional>

#include "batch.hpp"
#include "blocks.hpp"
#include "cloud_families.hpp"
#include "lattice_families.hpp"
#include "local_stencil.hpp"
#include "engine/assembly/assembly.hpp"

namespace perikit {

/// Any weighted kinematics. On a lattice, points with the same family share one stencil (a class), and eight neighbours in a row
/// are one small matrix product; classes beyond a cap in bytes, and clouds, build their stencil when they need it.
template <int D>
class WeightedModel final : public AssemblingModel {
 public:
  explicit WeightedModel(const ModelParts& parts);

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override;
  Field shape_tensor_condition() override { return condition_; }
  Field damage() override { return damage_; }
  ModelReport report() const override;

 private:
  static constexpr std::size_t cloud_block = 64;
  static constexpr std::size_t stencil_bytes = std::size_t{256} << 20;   ///< cap for stored stencils

  /// Points first ... first + lanes with one stencil: 8 whole lattice points, or a single point.
  struct Group {
    std::int32_t first;
    std::int32_t family;       ///< stored stencil, or -1: built on the fly
    std::int32_t bonds;        ///< row of lattice_bonds_ (lattices)
    bool whole;
  };
  struct Memory {
    FamilyArrays family;
    LocalStencil stencil;
    AlignedVector<double> weights, share, u, w, t;
    double owner_H[72], owner_dH[72];   ///< of the owners, where the map is selective: [component][8]
    std::vector<std::int32_t> index;
  };

  void prepare_lattice(const InfluenceFunction& influence);
  void prepare_cloud(const InfluenceFunction& influence);
  void count(const LocalStencil& stencil, std::size_t points);
  void load_family(const Group& group, Memory& m) const;
  EvaluationStatus run(Pass& pass);
  void block(std::size_t b, Pass& pass);
  /// Keeps Hbar of the points, evaluation point 0, and gives their volume changes to every lane of the batch.
  void keep_owner_gradients(int points, Memory& m, BatchScratch& s, bool tangent) const noexcept;
  int group(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy);
  void gather(const Group& g, const LocalStencil& stencil, ConstFieldView u, const Memory& m, AlignedVector<double>& out) const;
  void scatter(const Group& g, const LocalStencil& stencil, const Memory& m, FieldView out) const;

  const Body& body_;
  const Laws& laws_;
  std::shared_ptr<const Kinematics> kinematics_;
  KinematicsTraits traits_;
  int parts_;                                               ///< evaluation points per point; 0: one per bond
  std::optional<LatticeFamilies> lattice_;
  std::vector<std::vector<std::uint16_t>> lattice_bonds_;   ///< slots of each class of family
  std::vector<LocalStencil> stencils_;
  std::optional<CloudFamilies> cloud_;
  AlignedVector<double> normaliser_;                        ///< N_i of bond weights, by point
  std::vector<Group> groups_;
  std::vector<std::size_t> block_first_;
  Colouring cloud_colouring_;
  Field condition_, damage_;
  std::size_t bonds_ = 0, broken_ = 0, singular_ = 0, fallbacks_ = 0, dropped_ = 0;
  ScratchPool scratch_;
  std::vector<std::unique_ptr<Memory>> memory_;
};

}  // namespace perikit
