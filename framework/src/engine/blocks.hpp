#pragma once
/// Fixed blocks of work and their colours: blocks of one colour touch disjoint sets of points, so that they may scatter at the
/// same time, and colours run one after the other, so that sums never depend on the number of threads.

#include <cstdint>
#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

class Colouring {
 public:
  Colouring() = default;
  /// touches[b]: the units (any fixed grouping of points) that block b reads or writes by scatter.
  explicit Colouring(const std::vector<std::vector<std::int32_t>>& touches, std::size_t units);

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
