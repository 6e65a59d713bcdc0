#pragma once
/// Fixed blocks of work, which of them reach which, and their colours: blocks of one colour touch disjoint sets of points, so that
/// they may scatter at the same time, and colours run one after the other, so that sums never depend on the number of threads.

#include <cstdint>
#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

/// Units are any fixed grouping of points in which every block is one.
struct BlockReach {
  std::size_t units = 0;
  std::vector<std::int32_t> own;                     ///< unit of block b
  std::vector<std::vector<std::int32_t>> touches;    ///< units that hold the points of block b and of all their families
};

class Colouring {
 public:
  Colouring() = default;
  explicit Colouring(const BlockReach& reach);
  /// Given colours, by block.
  explicit Colouring(const std::vector<std::int32_t>& colour_of);

  template <class Body>
  void for_each(Body&& body) const {
    for (const std::vector<std::int32_t>& colour : colours_) {
      parallel_for(colour.size(), [&](std::size_t i) { body(static_cast<std::size_t>(colour[i])); });
    }
  }
  std::size_t colours() const noexcept { return colours_.size(); }

 private:
  std::vector<std::vector<std::int32_t>> colours_;
};

}  // namespace perikit
