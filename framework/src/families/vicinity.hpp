#pragma once
/// What lies within so many families of some points, or a little farther: by cells of a third of the horizon, in time that does
/// not depend on how many bonds there are.

#include <cstdint>
#include <span>
#include <vector>

#include "families/families.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

class Vicinity {
 public:
  /// The body must outlive it.
  explicit Vicinity(const Body& body);

  /// Nothing is in it.
  void clear();
  /// Adds the cells that so many bonds in a row may reach from these points.
  void add(std::span<const std::int32_t> points, int families);
  /// Adds those that so many more may reach.
  void grow(int families);
  bool holds(std::size_t p) const noexcept { return in_[cell_[p]]; }
  /// The groups of eight points that have a point in it.
  GroupMarks groups() const;

 private:
  void grow(std::vector<std::uint8_t>& cells, int families);

  const Body& body_;
  double size_ = 0;  ///< of a cell [m]
  std::size_t count_[3] = {1, 1, 1};
  std::vector<std::uint32_t> cell_;  ///< by point; dead points: the last cell, in which there is nothing
  std::vector<std::uint8_t> in_, added_;
  std::vector<std::int32_t> left_;  ///< work of `grow`
};

}  // namespace perikit
