#pragma once
/// Parts of a body that no wave has reached: far enough from every point that moves, a block of points at rest has no forces, for
/// P(0) is exactly zero. Leaving it out changes no bit of the result.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "families/blocks.hpp"
#include "families/resting_counts.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/point_motion.hpp"

namespace perikit {

/// An evaluation is a sequence of passes over the blocks, and each reads what the one before it left at one family's reach. With
/// d the distance of a block from the next that moves, counted in such steps, pass k has something to do where d <= k.
class RestingBlocks {
 public:
  /// No block is ever quiet.
  RestingBlocks() = default;
  /// history: laws remember what has passed; a block that was awake once stays awake.
  explicit RestingBlocks(BlockReach reach, bool history = false)
      : reach_(std::move(reach)),
        distance_(reach_.own.size(), 0),
        before_(distance_),
        moved_(history ? distance_.size() : 0, 0),
        late_(distance_.size()) {
    for (std::size_t b = 0; b < late_.size(); ++b) late_[b] = reach_.late(b);
  }

  /// At the beginning of an evaluation of `passes` passes: moves(b) says whether a point of block b moves. arrival: of the
  /// displacements of points of other ranks, motion: of points; null: they are there. Where all blocks are looked at, all have moved.
  template <class Moves>
  void look(int passes, const Moves& moves, Arrival* arrival = nullptr, PointMotion* motion = nullptr) {
    if (distance_.empty()) return;
    begin(passes);
    if (all_move_) {
      wake_all();
      return count();
    }
    if (motion) motion->finish();
    auto look_at = [&](std::size_t b) {
      const bool now = (!moved_.empty() && moved_[b]) || moves(b);
      if (!moved_.empty()) moved_[b] = now;
      distance_[b] = now ? 0 : far;
    };
    if (arrival && arrival->pending()) {
      // Where all moves that is here already, so may the rest; else what is at rest depends on what arrives.
      parallel_for(distance_.size(), [&](std::size_t b) {
        if (!late_[b]) return look_at(b);
        distance_[b] = 0;
        if (!moved_.empty()) moved_[b] = 1;
      });
      if (quiet() == 0) return count();
      arrival->finish();
    }
    parallel_for(distance_.size(), look_at);
    all_move_ = quiet() == 0;
    spread();
  }
  /// At the beginning of an evaluation that leaves nothing out.
  void wake();

  /// No block is quiet from now on: the history of a run that goes on says nothing of what has moved.
  void stay_awake() { std::fill(moved_.begin(), moved_.end(), std::uint8_t{1}); }

  /// Whether pass k >= 1 has something to do in block b.
  bool awake(std::size_t b, int pass) const noexcept { return distance_.empty() || distance_[b] <= pass; }
  /// The same of the first pass, which also clears what an earlier evaluation has left in the block.
  bool begins(std::size_t b) const noexcept { return awake(b, 1) || before_[b] <= passes_before_; }

  RestingCounts counts() const noexcept { return counts_; }

  /// Whether u differs from zero (or is no number) somewhere in begin <= p < end.
  static bool moves(ConstFieldView u, std::size_t begin, std::size_t end) noexcept;

 private:
  static constexpr std::uint8_t far = 255;
  void begin(int passes);
  void spread();
  void wake_all();
  std::int64_t quiet() const noexcept { return std::count(distance_.begin(), distance_.end(), far); }
  void count() noexcept {
    counts_.blocks += static_cast<std::int64_t>(distance_.size());
    counts_.quiet += quiet();
  }

  BlockReach reach_;
  std::vector<std::uint8_t> distance_, before_;  ///< in this evaluation and in the one before
  std::vector<std::uint8_t> moved_;              ///< ever, where laws have a history; else empty
  std::vector<std::uint8_t> late_;               ///< reads what comes from other ranks
  std::vector<std::uint8_t> reached_;            ///< by unit
  bool all_move_ = false;                        ///< once all blocks have moved they are not looked at any more: few come to rest to the last bit
  int passes_ = 1, passes_before_ = 1;
  RestingCounts counts_;
};

}  // namespace perikit
