#pragma once
#include <memory>
#include <mutex>
#include <optional>

#include "operators/batch.hpp"
#include "spaces/bond_kernel.hpp"
#include "families/lattice_bonds.hpp"
#include "spaces/lattice_kernels.hpp"
#include "spaces/lattice_stencils.hpp"
#include "families/quiet_blocks.hpp"
#include "assembly/assembly.hpp"

namespace perikit {

/// Any point or bond kinematics on a lattice. One evaluation runs through fixed blocks:
///   points: gradient -> law -> flux                              | divergence
///   bonds:  gradient of points | bonds by colour: law, scatter   | flux | divergence
///   (order 2 and more: stored stencils take the places of the gradient, and of flux and divergence)
template <int D>
class LatticeModel final : public AssemblingModel {
 public:
  explicit LatticeModel(const ModelParts& parts);

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override;
  Field shape_tensor_condition() override;
  Field damage() override;
  ModelReport report() const override;
  QuietCounts quiet_counts() const override { return quiet_.counts(); }

  const LatticeFamilies& families() const noexcept { return families_; }
  /// Zero in the dead lanes of chunks.
  void clean(FieldView out) const noexcept;

 private:
  double energy_of(ConstFieldView u, const GroupMarks& marks) override;
  std::vector<BondChange> bonds_changed(std::span<const std::int32_t> points) override;
  /// selective: c of a lane (selective_map.hpp).
  double share_of_volume(const LatticeChunk& chunk, int lane) const noexcept {
    const LatticePattern& pattern = families_.pattern(chunk);
    return pattern.singular >> lane & 1 ? 0.0 : pattern.left[lane];
  }
  EvaluationStatus run(Pass& pass);
  void zero_rows(const LatticeBlock& block, FieldView out) const noexcept;
  /// Points: memory of a thread for a few rows of a block.
  struct RowScratch {
    Field flux;                        ///< Q
    std::vector<std::int32_t> index;   ///< of the chunks: `own` of the block, then those beyond the ends of its rows
    std::vector<std::int64_t> at;      ///< where their Q is
    std::size_t own = 0;
  };
  std::int64_t evaluate_chunks(const std::int32_t* index, int n, BatchScratch& s, const Pass& pass, double* energy) const;
  void points_block(std::size_t b, Pass& pass);
  void place_rows(std::span<const LatticeRow> rows, std::size_t& chunk, std::size_t end, RowScratch& r) const;
  void gradients_of_rows(const std::int32_t* index, int n, ConstFieldView u, double* H) const noexcept;
  void rows_block(std::size_t b, Pass& pass);
  std::int64_t row_width(const LatticeRow& row) const noexcept;
  void gradient_block(std::size_t b, Pass& pass);
  void bonds_block(std::size_t b, Pass& pass);
  int bonds_of_chunk(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, Pass& pass, double* energy);
  void store_corrections();
  void bond_vectors(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, BondVectors& vectors) const;
  void point_to_volumes(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s) const noexcept;
  void add_pressures(const LatticeChunk& chunk, std::size_t slot, int slots, const BatchScratch& s, bool both_ends, bool tangent) noexcept;
  OwnerGradients owner_gradients(const LatticeChunk& chunk, bool tangent) const noexcept;
  void finish_stress(std::size_t b, Pass& pass);
  void divergence(Pass& pass, int number) const;

  const Body& body_;
  const Laws& laws_;
  Formulation formulation_;
  bool pairs_;                       ///< each bond evaluated once for both ends
  LatticeFamilies families_;
  LatticeOperator<D> operator_;      ///< order 1
  std::optional<LatticeStencils<D>> stencils_;   ///< higher orders
  Field flux_;                       ///< bonds: the stress on Hbar, then Q
  std::vector<RowScratch> row_scratch_;         ///< by thread
  std::int64_t row_gap_ = 0, most_cells_ = 0;   ///< cells between rows there; of all rows at once
  Field gradient_, direction_;       ///< Hbar of u and of w (bonds)
  Field scale_;                      ///< V_i / N_i of bond weights
  Field volume_, pressure_;          ///< selective: volume changes of points; pressures (and their rates) on them
  int slots_at_once_;                ///< of a bond batch
  std::vector<double> slot_xi_[3], slot_g_[3], slot_weight_;
  std::vector<AlignedVector<double>> pattern_g_;   ///< corrections by pattern: [slot group][component][lane]; empty: computed
  AlignedVector<double> lane_xi_;                  ///< bond vectors, likewise
  std::vector<std::pair<std::int32_t, std::uint8_t>> partly_dead_;
  QuietBlocks quiet_;
  std::optional<LatticeBonds> bonds_;  ///< only with damage
  ScratchPool scratch_;
};

}  // namespace perikit
