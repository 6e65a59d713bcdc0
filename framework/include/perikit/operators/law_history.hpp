#pragma once
/// History of rate laws at the evaluation points of one model.

#include <cstddef>
#include <span>
#include <vector>

#include "perikit/core/field.hpp"

namespace perikit {

/// Each batch has a place of its own, found by the block that evaluates it and the number of lanes that came before it in that
/// block: every evaluation must go through the same batches in the same order within each block. Within a place component c of
/// lane l is [c * stride + l], with the lanes of the batch as stride.
class LawHistory {
 public:
  /// components: doubles per evaluation point, the most that any law of the body needs.
  explicit LawHistory(int components) : components_(static_cast<std::size_t>(components)) {}

  struct Place {
    const double* begin = nullptr;  ///< history at the beginning of the step; null: fresh
    double* end = nullptr;          ///< where to put it if the step ends here; null: not wanted
    std::size_t stride = 0;
  };

  /// Before an evaluation: its number of blocks. The first evaluation only counts lanes, on fresh history; then `allocate`.
  void prepare(std::size_t blocks) {
    if (!allocated_) lanes_.resize(blocks, 0);
  }
  void allocate();
  /// The place of the next batch of a block; moves `cursor`, which begins each block at 0. One thread a block.
  Place next(std::size_t block, std::size_t& cursor, int lanes) noexcept;

  /// Evaluations that end a step of this length [s] put their history aside; 0: none does.
  void set_time_step(double time_step) noexcept { time_step_ = time_step; }
  double time_step() const noexcept { return time_step_; }
  /// The step is done: what the last evaluation put aside is the history from now on.
  void advance() noexcept { begin_.swap(end_); }

  /// All that a run continues from.
  std::span<double> values() noexcept { return begin_; }
  std::span<const double> values() const noexcept { return begin_; }
  std::size_t bytes() const noexcept { return 2 * begin_.size() * sizeof(double) + first_.size() * sizeof(std::size_t); }

 private:
  std::size_t components_;
  std::vector<std::size_t> lanes_;  ///< by block, while counting
  std::vector<std::size_t> first_;  ///< first lane of each block
  AlignedVector<double> begin_, end_;
  double time_step_ = 0;
  bool allocated_ = false;
};

}  // namespace perikit
