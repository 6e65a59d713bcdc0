#pragma once
#include <memory>
#include <vector>

#include "body/partition/block_colours.hpp"
#include "families/blocks.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "families/equal_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "operators/bond_samples.hpp"
#include "spaces/evaluation_space.hpp"
#include "spaces/weighted/local_stencil.hpp"
#include "spaces/weighted/mirrored_stencil.hpp"
#include "spaces/weighted/sparse_stencils.hpp"

namespace perikit {

/// Evaluation points with weights of their own over the family (weighted kinematics, and point gradients of orders above 1). On a
/// lattice, points with equal families are a class that shares one stencil in the basis of its
/// mirrors, and up to eight of them are evaluated at a time. Points of a cloud with few evaluation points keep their stencils,
/// without the bonds that an evaluation point does not see, and make them anew where bonds have failed. With an evaluation point at every bond, points of a cloud, of rare
/// classes, and of classes beyond a cap in bytes make their stencil when they need it. So does a point whose bonds have failed:
/// it leaves its group.
template <int D>
class Weighted final : public EvaluationSpace {
 public:
  explicit Weighted(const SpaceParts& parts);

  void run(Pass& pass) override;
  void complete(GroupMarks& marks) const override {
    if (lattice_) lattice_->tiles.complete(marks);
    else mark_whole_runs(body_.block_points() / padding, marks);
  }
  std::size_t numbers() const noexcept override { return numbers_; }
  PointNumbers number_of(std::int32_t p, std::int32_t far, int part) const noexcept override;
  void bonds_changed(std::span<const std::int32_t> points) override;
  std::size_t factors() const noexcept override {
    return cloud_ && parts_ == 0 ? families_.bonds() : 0;
  }
  void set_factors(std::span<const double> factors) override { factor_ = factors.empty() ? nullptr : factors.data(); }
  void shift_gradients(ConstFieldView lambda) override;
  void report(ModelReport& report) const override;

 private:
  std::size_t blocks() const noexcept { return block_first_.size() - 1; }
  /// Where a run puts the energy of block b.
  std::size_t first_group(std::size_t b) const noexcept { return lattice_ ? lattice_->tiles.first_group(b) : b * body_.block_points() / padding; }
  static constexpr std::size_t stencil_bytes = std::size_t{256} << 20;  ///< cap for stored stencils
  /// Fewer points with an evaluation point at every bond are faster one by one.
  static constexpr std::size_t fewest_together = 3;

  /// Up to eight points with one stored stencil, up to eight points of a cloud with stored stencils, or a single point that makes
  /// its own.
  struct Group {
    std::uint32_t first;       ///< into members_: eight entries where there is one stencil, the last ones may repeat the first
    std::int32_t family;       ///< class (lattices)
    std::int32_t stencil;      ///< index of the stored one, or -1
    std::uint8_t count;
    bool contiguous;           ///< eight points in a row
    std::uint8_t live = 0xff;  ///< lanes whose points have not left
  };
  struct Memory {
    FamilyArrays family;
    LocalStencil<D> stencil;
    AlignedVector<double> share, u, w, t, m, dm;
    double owner_H[72], owner_dH[72];     ///< of the owners, where the map is selective: [component][8]
    double pressure[2][8];                ///< on their gradients, and its rate
    std::vector<std::int32_t> original;   ///< which of the set-up's evaluation points they are; empty: the same
  };
  /// Where the points are.
  struct Place {
    std::uint32_t block, group;
    std::uint8_t lane;
    bool left;                 ///< its bonds have failed: it makes its own stencil
  };

  // Set-up (weighted_groups.cpp).
  void prepare_lattice();
  void prepare_cloud();
  /// Clouds: counts what the stencils of all points lack, and keeps those with few evaluation points.
  void make_cloud_stencils();
  /// Stencils of the classes, the most common ones first, up to the cap; by class: index of the stencil or -1.
  std::vector<std::int32_t> store_stencils();
  void group_points(std::span<const std::int32_t> points, std::int32_t family, std::int32_t stencil);
  void number_groups();
  void place_points();
  void load_class(std::int32_t family, Memory& m) const;
  /// The bonds of a point, all of the set-up or what is left of them, and their shares.
  void load_family(std::size_t p, BondsOf which, Memory& m) const;
  void build(Memory& m, int fields, const double* const (*u)[D], double family_volume = 0) const {
    m.stencil.build(rules_, m.family, m.share.data(), fields, u, family_volume);
  }

  // Evaluation (weighted.cpp).
  void block(std::size_t b, Pass& pass);
  /// Evaluate a group; -1, or an inadmissible one of its points.
  std::int32_t single(std::size_t g, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  std::int32_t together(std::size_t g, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  std::int32_t side_by_side(std::size_t g, std::size_t b, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  std::int32_t evaluate_detached_point(std::int32_t p, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  /// A point with the family in m; `number` is that of its first evaluation point.
  std::int32_t evaluate_family(std::int32_t p, std::int64_t number, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  /// The stencil of a single point: the one that was made of the family in m, or a stored one.
  struct MadeStencil;
  struct StoredStencil;
  template <class Stencil>
  std::int32_t evaluate_point(std::int32_t p, std::int64_t number, Stencil stencil, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  /// Which of the bonds of p at the set-up leads to `far`.
  std::int32_t bond_at_set_up(std::int32_t p, std::int32_t far, const Group& g) const noexcept;
  /// Of evaluation point k of a point of a cloud, where they belong to bonds.
  std::size_t factor_of(std::int32_t p, int k) const noexcept {
    return static_cast<std::size_t>(cloud_->lists().first[static_cast<std::size_t>(p)]) + static_cast<std::size_t>(k);
  }
  /// w / W of it; evaluation points of the map's owners, k < 0, have no weight.
  double factor(std::int32_t p, int k) const noexcept { return factor_ && k >= 0 ? factor_[factor_of(p, k)] : 1.0; }
  /// Evaluation point k of lane l of a group has the number number_of(g) + 8 k + l.
  std::int64_t number_of(std::size_t g) const noexcept { return number_.empty() ? 0 : static_cast<std::int64_t>(number_[g]); }
  /// u of the far ends relative to the owner, [c * size + k].
  void load_differences(std::int32_t point, const AlignedVector<Row>& rows, const Memory& m, AlignedVector<double>& out) const;
  void scatter_rows(std::int32_t p, Memory& m);
  /// Lanes of a group to be evaluated: the others have no gradient and no weight.
  std::uint8_t lanes(const Group& g, const Pass& pass) const noexcept;
  /// W of an evaluation point of p with a share of 1.
  double weight(std::int32_t p) const noexcept;
  /// The far end that samples of part k have: none, or the part by name where derivatives of each are asked for (BondSamples::part).
  std::int32_t far_of_part(int k, const Pass& pass) const noexcept {
    return k >= 0 && formulation_.own_stencils() && pass.bonds && pass.bonds->what() == BondSampling::derivative ? BondSamples::part(k) : -1;
  }
  /// Keeps Hbar of one or eight points, evaluation point 0, and gives their volume changes to every lane of the batch. share: c of the
  /// selective map; 1 in groups, which points leave with the first bond that fails.
  void keep_owner_gradients(int points, double share, Memory& m, BatchScratch& s, bool tangent) const noexcept;
  /// No gradient at evaluation points slot ... slot + slots - 1, of eight owners side by side, of the owners that are not kept.
  static void clear_lanes(std::uint8_t kept, int slot, int slots, double* H, double* dH) noexcept;
  /// Of the owners side by side, owner l at lanes l, l + wide, ...: pressure on their gradients and its rate += those of the lanes.
  static void add_pressures(int lanes, int wide, const BatchScratch& s, bool tangent, Memory& m) noexcept;
  /// s.P of lanes 0 ... 7 <- the stress that these pressures are on the kept gradients of the owners.
  void owner_stresses(const Memory& m, bool tangent, BatchScratch& s) const noexcept;

  const Families& families_;
  const LatticeFamilies* lattice_;
  const CloudFamilies* cloud_;
  const Body& body_;
  const Formulation& formulation_;
  const Laws& laws_;
  StencilRules rules_;
  bool selective_, share_;
  int owners_;  ///< evaluation points without a share, for the selective map
  int parts_;   ///< evaluation points per point; 0: one per bond
  std::vector<FamilyClass> classes_;
  std::vector<MirroredStencil<D>> stencils_;
  std::vector<std::int32_t> members_;
  std::vector<SparseStencils<D>> sparse_;  ///< clouds with few evaluation points: by block
  std::vector<Group> groups_;
  std::vector<std::size_t> block_first_;
  std::vector<std::size_t> number_;        ///< by group, where laws have a history
  std::size_t numbers_ = 0;
  const double* factor_ = nullptr;  ///< w_q / W_q; null: 1
  Colouring cloud_colouring_;
  std::size_t fallbacks_ = 0, dropped_ = 0;
  ArrivingPieces pieces_;
  bool singles_ = false;  ///< some points are evaluated one by one: they use rows
  std::vector<Place> place_;                     ///< by point, once bonds have failed, and where evaluation points have numbers
  std::vector<std::vector<std::int32_t>> left_;  ///< by block: points that have left their group, ascending
  std::vector<std::unique_ptr<SparseStencils<D>>> remade_;  ///< clouds with few evaluation points: by point that has left, as its bonds are now; null: to be made
  AlignedVector<Row> u_rows_, w_rows_, out_rows_;
  ScratchPool scratch_;
  std::vector<std::unique_ptr<Memory>> memory_;
};

}  // namespace perikit
