#pragma once
/// The families of a body over block rows: live points numbered in ascending order of their field index.

#include <cstdint>
#include <span>
#include <vector>

#include "families/families.hpp"

namespace perikit {

class BlockRows {
 public:
  explicit BlockRows(const Families& families);

  const Families& families() const noexcept { return families_; }
  const Body& body() const noexcept { return families_.body(); }
  std::size_t size() const noexcept { return point_.size(); }
  std::size_t bonds() const noexcept { return lists().neighbour.size(); }
  /// Field index of each block row, ascending.
  const std::vector<std::int32_t>& points() const noexcept { return point_; }
  std::size_t point(std::size_t row) const noexcept { return static_cast<std::size_t>(point_[row]); }
  double volume(std::size_t row) const noexcept { return body().volume(point(row)); }
  /// Bonds of the set-up, failed ones too, in block rows; lists().first numbers them.
  const FamilyLists& lists() const noexcept { return cloud_lists_ ? *cloud_lists_ : lattice_lists_; }
  std::size_t first(std::size_t row) const noexcept { return static_cast<std::size_t>(lists().first[row]); }
  /// Block rows of the family, ascending, without the point itself.
  std::span<const std::int32_t> neighbours(std::size_t row) const noexcept {
    return {lists().neighbour.data() + first(row), first(row + 1) - first(row)};
  }
  /// Rows with the whole family of a lattice: all of them have the same stencils.
  bool whole(std::size_t row) const noexcept { return !whole_.empty() && whole_[row] && !families_.lost_bonds(point(row)); }
  /// Bonds in the order of neighbours(row), with the inverse shape tensor.
  void load(std::size_t row, FamilyArrays& out) const { families_.load(point(row), BondsOf::set_up, out); }
  std::size_t bytes() const noexcept;

 private:
  const Families& families_;
  const FamilyLists* cloud_lists_ = nullptr;   ///< of a cloud, else null
  FamilyLists lattice_lists_;
  std::vector<std::int32_t> point_;
  std::vector<std::uint8_t> whole_;  ///< lattices: by row, at the set-up
};

}  // namespace perikit
