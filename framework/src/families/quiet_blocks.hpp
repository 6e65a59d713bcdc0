#pragma once
/// Parts of a body that no wave has reached: far enough from every point that moves, a block of points at rest has no forces, for
/// P(0) is exactly zero. Leaving it out changes no bit of the result.

#include <cstdint>
#include <vector>

#include "families/blocks.hpp"
#include "perikit/core/field.hpp"
#include "perikit/terms/model.hpp"

namespace perikit {

/// An evaluation is a sequence of passes over the blocks, and each reads what the one before it left at one family's reach. With
/// d the distance of a block from the next that moves, counted in such steps, pass k has something to do where d <= k.
class QuietBlocks {
 public:
  /// No block is ever quiet.
  QuietBlocks() = default;
  explicit QuietBlocks(BlockReach reach) : reach_(std::move(reach)), distance_(reach_.own.size(), 0), before_(distance_) {}

  /// At the beginning of an evaluation of `passes` passes: moves(b) says whether a point of block b moves.
  template <class Moves>
  void look(int passes, const Moves& moves) {
    if (distance_.empty()) return;
    begin(passes);
    parallel_for(distance_.size(), [&](std::size_t b) { distance_[b] = moves(b) ? 0 : far; });
    spread();
  }
  /// At the beginning of an evaluation that leaves nothing out.
  void wake();

  /// Whether pass k >= 1 has something to do in block b. 
  bool awake(std::size_t b, int pass) const noexcept { return distance_.empty() || distance_[b] <= pass; }
  /// The same of the first pass, which also clears what an earlier evaluation has left in the block.
  bool begins(std::size_t b) const noexcept { return awake(b, 1) || before_[b] <= passes_before_; }

  QuietCounts counts() const noexcept { return counts_; }

  /// Whether u differs from zero (or is no number) somewhere in begin <= p < end.
  static bool moves(ConstFieldView u, std::size_t begin, std::size_t end) noexcept;

 private:
  static constexpr std::uint8_t far = 255;
  void begin(int passes);
  void spread();

  BlockReach reach_;
  std::vector<std::uint8_t> distance_, before_;   ///< in this evaluation and in the one before
  std::vector<std::uint8_t> reached_;             ///< by unit
  int passes_ = 1, passes_before_ = 1;
  QuietCounts counts_;
};

}  // namespace perikit
