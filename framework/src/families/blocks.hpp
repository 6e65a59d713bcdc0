#pragma once
/// Fixed blocks of work, which of them reach which, and their colours: blocks of one colour touch disjoint sets of points, so that
/// they may scatter at the same time. Blocks that may touch the same points scatter in the order of their colours, so that sums never
/// depend on the number of threads.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/group_marks.hpp"
#include "core/threads/loop_order.hpp"

namespace perikit {

class Body;

/// Units are any fixed grouping of points in which every block is one.
struct BlockReach {
  std::size_t units = 0;
  std::vector<std::int32_t> own;                   ///< unit of block b
  std::vector<std::vector<std::int32_t>> touches;  ///< units that hold the points of block b and of all their families
  std::vector<std::uint8_t> elsewhere;             ///< by unit: whether it holds points whose values arrive; empty: none does

  /// Whether block b reads what comes from other ranks.
  bool late(std::size_t b) const noexcept;
};

/// By internal index, of a part of a body: 1 where values come from other ranks: of ghosts, and of all images, which follow their sources.
/// Empty: this is no part.
std::vector<std::uint8_t> arriving_points(const Body& body);

/// All blocks, those first that read nothing of other ranks.
class BlockSequence {
 public:
  BlockSequence() = default;
  explicit BlockSequence(const BlockReach& reach);
  /// body(b) for all blocks, in any order. arrival: of what comes from other ranks; null: it is there.
  template <class Body>
  void for_each(Body&& body, Arrival* arrival = nullptr) const {
    parallel_for(blocks_.size(), [&](std::size_t i) { body(static_cast<std::size_t>(blocks_[i])); }, {early_, arrival});
  }

 private:
  std::vector<std::int32_t> blocks_;
  std::size_t early_ = 0;
};

/// By block: the first colour of which no earlier block touches one of the same units.
std::vector<std::int32_t> free_colours(const BlockReach& reach);

class Colouring {
 public:
  Colouring() = default;
  explicit Colouring(const BlockReach& reach);
  /// Lists the cells that block b writes to, each once.
  using Touch = std::function<void(std::size_t b, std::vector<std::int32_t>& touched)>;
  /// Given colours, by block, of which none has two blocks that touch one of the cells. The smaller cells are, the fewer blocks wait without need.
  Colouring(const BlockReach& reach, const std::vector<std::int32_t>& colour_of, std::size_t cells, const Touch& touch);

  /// body(b) for all blocks. A block does not wait for a whole colour, only for those of lower colours that touch what it
  /// touches. arrival: of what comes from other ranks; null: it is there. Blocks that read it come last, with those that wait for
  /// them.
  template <class Body>
  void for_each(Body&& body, Arrival* arrival = nullptr) const {
    if (order_) return parallel_for(*order_, body, arrival);
    if (arrival) arrival->finish();
  }
  std::size_t colours() const noexcept { return colours_; }

 private:
  std::size_t colours_ = 0;
  std::unique_ptr<LoopOrder> order_;  ///< of blocks; null: there are none
};

}  // namespace perikit
