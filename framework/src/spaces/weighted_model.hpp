#pragma once
#include <memory>
#include <optional>
#include <span>

#include "operators/batch.hpp"
#include "families/blocks.hpp"
#include "families/cloud_families.hpp"
#include "families/cloud_rows.hpp"
#include "assembly/assembly.hpp"
#include "families/family_classes.hpp"
#include "families/lattice_bonds.hpp"
#include "families/lattice_families.hpp"
#include "spaces/local_stencil.hpp"
#include "spaces/mirrored_stencil.hpp"
#include "families/quiet_blocks.hpp"
#include "spaces/sparse_stencils.hpp"

namespace perikit {

/// Any weighted kinematics. On a lattice, points with equal families are a class that shares one stencil in the basis of its
/// mirrors, and up to eight of them are evaluated at a time. Points of a cloud with few evaluation points keep their stencils,
/// without the bonds that an evaluation point does not see. With an evaluation point at every bond, points of a cloud, of rare
/// classes, and of classes beyond a cap in bytes make their stencil when they need it. So does a point whose bonds have failed:
/// it leaves its group.
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
  QuietCounts quiet_counts() const override { return quiet_.counts(); }

 private:
  static constexpr std::size_t cloud_block = 64;
  static constexpr std::size_t stencil_bytes = std::size_t{256} << 20;  ///< cap for stored stencils

  /// Fewer points with an evaluation point at every bond are faster one by one.
  static constexpr std::size_t fewest_together = 3;

  /// Up to eight points with one stored stencil, up to eight points of a cloud with stored stencils, or a single point that makes
  /// its own.
  struct Group {
    std::uint32_t first;   ///< into members_: eight entries where there is one stencil, the last ones may repeat the first
    std::int32_t family;   ///< class (lattices)
    std::int32_t stencil;  ///< index of the stored one, or -1
    std::uint8_t count;
    bool contiguous;  ///< eight points in a row
    std::uint8_t live = 0xff;  ///< lanes whose points have not left
  };
  struct Memory {
    FamilyArrays family;
    LocalStencil<D> stencil;
    AlignedVector<double> share, u, w, t, m, dm;
    double owner_H[72], owner_dH[72];  ///< of the owners, where the map is selective: [component][8]
    std::vector<std::int32_t> index;
  };

  void prepare_lattice(const InfluenceFunction& influence);
  /// Stencils of the classes, the most common ones first, up to the cap; by class: index of the stencil or -1.
  std::vector<std::int32_t> store_stencils();
  void group_points(std::span<const std::int32_t> points, std::int32_t family, std::int32_t stencil);
  void prepare_cloud(const InfluenceFunction& influence);
  /// Bonds of a point as arrays with their shares; on a cloud with b_k where it is stored.
  void load_cloud_family(std::size_t p, Memory& m) const;
  void load_class(std::int32_t family, Memory& m) const;
  void set_lattice_shares(double scale, Memory& m) const;
  void set_cloud_shares(std::size_t p, Memory& m) const;
  /// Stencil of the family in m, with the moments of these fields.
  void build(Memory& m, int fields, const double* const (*u)[D]) const;
  /// u of the far ends relative to the owner, [c * size + k].
  void load_differences(std::int32_t point, const AlignedVector<Row>& rows, Memory& m, AlignedVector<double>& out) const;

  double energy_of(ConstFieldView u, const GroupMarks& marks) override;
  std::vector<BondChange> bonds_changed(std::span<const std::int32_t> points) override;
  /// With damage: where the points are.
  void prepare_damage();
  /// The bonds that are left to a point, as load_cloud_family.
  void load_own_family(std::int32_t p, Memory& m) const;

  EvaluationStatus run(Pass& pass);
  void block(std::size_t b, Pass& pass);
  /// Evaluate a group; -1, or an inadmissible one of its points.
  std::int32_t single(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy);
  /// With the family in m.
  std::int32_t evaluate_family(std::int32_t p, Memory& m, BatchScratch& s, Pass& pass, double* energy);
  /// Lanes of a group to be evaluated: the others have no gradient and no weight.
  std::uint8_t lanes(const Group& g, const Pass& pass) const noexcept;
  std::int32_t together(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy);
  std::int32_t side_by_side(const Group& g, std::size_t b, Memory& m, BatchScratch& s, Pass& pass, double* energy);
  /// W of evaluation point q of point p.
  double weight(std::int32_t p, double share) const noexcept;
  /// Keeps Hbar of one or eight points, evaluation point 0, and gives their volume changes to every lane of the batch. share: c of the
  /// selective map; 1 in groups, which points leave with the first bond that fails.
  void keep_owner_gradients(int points, double share, Memory& m, BatchScratch& s, bool tangent) const noexcept;

  /// The share of its influence at the set-up that a point has left.
  double left(std::int32_t p) const noexcept;
  /// No gradient at evaluation points slot ... slot + slots - 1, of eight owners side by side, of the owners that are not kept.
  static void clear_lanes(std::uint8_t kept, int slot, int slots, double* H, double* dH) noexcept;
  /// Of eight owners side by side (selective map): pressure on their gradients and its rate += those of the lanes, owner l at lanes
  /// l, l + 8, ...
  static void add_pressures(int lanes, const BatchScratch& s, bool tangent, double (&pressure)[2][8]);
  /// s.P of lanes 0 ... 7 <- the stress that these pressures are on the kept gradients of the owners.
  void owner_stresses(const Memory& m, bool tangent, const double (&pressure)[2][8], BatchScratch& s) const noexcept;

  const Body& body_;
  const Laws& laws_;
  Formulation formulation_;
  StencilRules rules_;
  bool share_;
  int owners_;  ///< evaluation points without a share, for the selective map
  int parts_;   ///< evaluation points per point; 0: one per bond
  std::optional<LatticeFamilies> lattice_;
  std::vector<FamilyClass> classes_;
  std::vector<MirroredStencil<D>> stencils_;
  std::vector<std::int32_t> members_;
  std::optional<CloudFamilies> cloud_;
  std::vector<SparseStencils<D>> sparse_;  ///< clouds with few evaluation points: by block
  std::vector<Group> groups_;
  std::vector<std::size_t> block_first_;
  Colouring cloud_colouring_;
  QuietBlocks quiet_;
  Field condition_, damage_;
  std::size_t bonds_ = 0, broken_ = 0, singular_ = 0, fallbacks_ = 0, dropped_ = 0;
  bool singles_ = false;  ///< some points are evaluated one by one: they use rows
  // With damage.
  struct Place {
    std::uint32_t block, group;
    std::uint8_t lane;
    bool left;  ///< its bonds have failed: it makes its own stencil
  };
  std::optional<LatticeBonds> lattice_bonds_;
  std::vector<Place> place_;                     ///< by point
  std::vector<std::vector<std::int32_t>> left_;  ///< by block: points that have left their group, ascending
  AlignedVector<Row> u_rows_, w_rows_, out_rows_;
  ScratchPool scratch_;
  std::vector<std::unique_ptr<Memory>> memory_;
};

}  // namespace perikit
