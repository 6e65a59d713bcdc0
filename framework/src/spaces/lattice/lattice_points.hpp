#pragma once
#include <vector>

#include "families/lattice/lattice_families.hpp"
#include "spaces/evaluation_space.hpp"
#include "spaces/lattice/lattice_gradient.hpp"
#include "spaces/lattice/work_of_groups.hpp"

namespace perikit {

/// Evaluation points at the points of a lattice, point gradients of order 1. An evaluation takes a few rows of a block at a time: gradient,
/// law, divergence. The stress K^-1 of the rows, Q, stays in the nearest caches and is stored nowhere.
template <int D>
class LatticePoints final : public EvaluationSpace {
 public:
  explicit LatticePoints(const SpaceParts& parts);

  void run(Pass& pass) override;
  bool moves_points() const noexcept override { return true; }
  void complete(GroupMarks& marks) const override { tiles_.complete(marks); }
  std::size_t numbers() const noexcept override { return tiles_.chunks.size() * chunk_points; }
  PointNumbers number_of(std::int32_t p, std::int32_t, int) const noexcept override {
    const std::int64_t number = std::int64_t{tiles_.chunk_of(p)} * chunk_points + p % chunk_points;
    return {number, number};
  }
  void bonds_changed(std::span<const std::int32_t>) override {}   // patterns are read where they are needed
  void report(ModelReport& report) const override;

 private:
  std::size_t blocks() const noexcept { return tiles_.blocks.size(); }
  /// Memory of a thread for a few rows of a block.
  struct Rows {
    Field flux;                        ///< Q
    std::vector<std::int32_t> index;   ///< of the chunks: `own` of the block, then those beyond the ends of its rows
    std::vector<std::int64_t> at;      ///< where their Q is
    std::size_t own = 0;
    /// Whole rows of so many chunks find zeros between them as far as that cell; 0: rows that differ have been there.
    std::int32_t clear_between = 0;
    std::int64_t clear_to = 0;
  };
  void one_by_one(std::size_t b, Pass& pass);
  void by_rows(std::size_t b, Pass& pass);
  bool evaluate(const std::int32_t* index, int n, BatchScratch& s, Pass& pass, GroupEnergy* energy) const;
  bool wanted(const LatticeRow& row, const Pass& pass) const noexcept;
  std::span<const LatticeRow> rows_from(std::size_t& first, std::size_t end, const Pass& pass) const;
  void place(std::span<const LatticeRow> rows, std::size_t& chunk, std::size_t end, Rows& r) const;
  void clear_gaps(std::int64_t end, Rows& r) const noexcept;
  void gradients(const std::int32_t* index, int n, ConstFieldView u, double* H) const noexcept;
  std::int64_t width(const LatticeRow& row) const noexcept;
  const LatticeChunk& chunk(std::int32_t index) const noexcept { return tiles_.chunks[static_cast<std::size_t>(index)]; }

  const LatticeFamilies& families_;
  const LatticeTiles& tiles_;
  const Laws& laws_;
  PointRoles roles_;
  LatticeOperator<D> operator_;
  std::vector<Rows> rows_;             ///< by thread
  std::int64_t gap_ = 0, most_ = 0;    ///< cells between rows there; of all rows at once
  ScratchPool scratch_;
};

}  // namespace perikit
