#pragma once
#include <optional>
#include <vector>

#include "families/lattice/lattice_families.hpp"
#include "spaces/bond_ends.hpp"
#include "spaces/bond_shape.hpp"
#include "spaces/evaluation_space.hpp"
#include "spaces/lattice/lattice_gradient.hpp"
#include "spaces/lattice/lattice_stencils.hpp"
#include "spaces/lattice/work_of_groups.hpp"

namespace perikit {

/// Evaluation points at the bonds of a lattice. An evaluation runs through
///   gradients of points | bonds by colour: gradient, law, scatter | stress on the point gradients -> flux | divergence
/// (orders above 1: stored stencils take the places of the gradient, and of flux and divergence.)
template <int D>
class LatticeBonds final : public EvaluationSpace {
 public:
  explicit LatticeBonds(const SpaceParts& parts);

  void run(Pass& pass) override;
  std::size_t numbers() const noexcept override { return (two_states_ ? 2 : 1) * one_end(); }
  PointNumbers number_of(std::int32_t p, std::int32_t far, int) const noexcept override {
    const std::int64_t state = state_number(static_cast<std::size_t>(tiles_.chunk_of(p)), families_.slots.with_shift(far - p), p % chunk_points);
    return {state >= far_number() && two_states_ ? state - far_number() : state, state};
  }
  bool evaluates(std::size_t p) const noexcept override {
    return roles_.wants(static_cast<std::size_t>(tiles_.chunk_of(static_cast<std::int64_t>(p))), &ChunkRole::bonds);
  }
  void bonds_changed(std::span<const std::int32_t> points) override;
  PointFlux point_flux() const noexcept override {
    if (last_ == Last::other || stencils_) return {};
    return {PointMatrices::of(gradient_, D), PointMatrices::of(flux_, D), last_ == Last::all_forces};
  }
  bool samples_along() const noexcept override { return pairs_ && !selective_ && laws_.single() && roles_.chunk.empty(); }
  void report(ModelReport& report) const override;

 private:
  /// Of a bond beside a point without a gradient: what its ends get beside what the adjoint gives them.
  struct OneSidedStress {
    std::size_t near, far;
    EndShares shares;  ///< less those that the adjoint takes for granted
    double stress[D * D];
  };
  std::size_t blocks() const noexcept { return tiles_.blocks.size(); }
  void gradients(std::size_t b, Pass& pass);
  void bonds(std::size_t b, Pass& pass);
  int bonds_of_chunk(std::size_t index, std::size_t slot, int slots, BatchScratch& s, Pass& pass, GroupEnergy* energy, std::vector<OneSidedStress>& later);
  void number(std::size_t index, std::size_t slot, int slots, bool whole, BatchScratch& s) const noexcept;
  std::int64_t state_number(std::size_t index, std::size_t slot, int l) const noexcept;
  void bond_vectors(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, BondVectors& vectors) const;
  void set_whole_vectors();
  void store_corrections();
  /// Calls visit(lane, slot, near, far, shares) for the bonds of a chunk beside points without a gradient.
  template <class Visit>
  void over_one_sided(const LatticeChunk& chunk, std::size_t slot, int slots, Visit&& visit) const;
  void one_sided_gradients(const LatticeChunk& chunk, std::size_t slot, int slots, const BondVectors& vectors, ConstFieldView u, ConstFieldView Hbar,
                           double* H, BatchScratch& s) const noexcept;
  void one_sided_stress(const LatticeChunk& chunk, std::size_t slot, int slots, const BondVectors& vectors, const BatchScratch& s,
                        std::vector<OneSidedStress>& later) const;
  void give(const std::vector<OneSidedStress>& corrections) noexcept;
  void divergence(Pass& pass, int number) const;
  bool samples_pairs(const Pass& pass) const noexcept;
  int sample_far_ends(int lanes, BatchScratch& s, Pass& pass);
  bool here(std::size_t b, const Pass& pass) const noexcept { return !pass.near || tiles_.marked(b, pass.near); }
  void finish_stress(std::size_t b, Pass& pass);
  // Selective map.
  void point_to_volumes(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s) const noexcept;
  void add_pressures(const LatticeChunk& chunk, std::size_t slot, int slots, const BatchScratch& s, bool both_ends, bool tangent) noexcept;
  OwnerGradients owner_gradients(const LatticeChunk& chunk, bool tangent) const noexcept;
  double share_of_volume(std::size_t p) const noexcept;

  std::size_t slots_each() const noexcept { return pairs_ ? families_.slots.half : families_.slots.size(); }
  std::int64_t far_number() const noexcept { return two_states_ ? static_cast<std::int64_t>(one_end()) : 0; }
  std::size_t one_end() const noexcept { return tiles_.chunks.size() * slots_each() * chunk_points; }

  const LatticeFamilies& families_;
  const LatticeTiles& tiles_;
  const Formulation& formulation_;
  const Laws& laws_;
  bool selective_;
  double far_share_;
  PointsWithoutGradient without_;
  bool pairs_;         ///< each bond evaluated once for both ends
  bool two_states_;    ///< and yet with a history of its own for each
  int slots_at_once_;  ///< of a bond batch
  ChunkRoles roles_;
  std::vector<SlotBatch> every_slot_;                                      ///< of both ends
  LatticeOperator<D> operator_;                                            ///< order 1
  std::optional<LatticeStencils<D>> stencils_;                             ///< higher orders
  Field flux_;                                                             ///< the stress on Hbar, then Q
  enum class Last { all_forces, some_forces, other } last_ = Last::other;  ///< run
  Field gradient_, direction_;                                             ///< Hbar of u and of w
  Field scale_;                                                            ///< V_i / N_i of bond weights
  Field volume_, pressure_;  ///< selective: volume changes of points; pressures (and their rates) on them
  std::vector<double> slot_xi_[3], slot_g_[3], slot_weight_;
  std::vector<AlignedVector<double>> pattern_g_;   ///< corrections by pattern of the set-up: [slot group][component][lane]; empty: computed
  AlignedVector<double> lane_xi_;                  ///< bond vectors, likewise
  ScratchPool scratch_;
};

}  // namespace perikit
