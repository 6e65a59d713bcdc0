#pragma once
/// Chosen cells of a lattice.

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace perikit {

class CellMask {
 public:
  using Cells = std::array<std::int64_t, 3>;
  /// Of the cells low ... high - 1.
  CellMask(const Cells& low, const Cells& high);

  void add(const Cells& k) { chosen_[at(k)] = 1; }
  /// The cells low ... high - 1.
  void add(const Cells& low, const Cells& high);
  bool holds(const Cells& k) const noexcept {
    for (std::size_t a = 0; a < 3; ++a)
      if (k[a] < low_[a] || k[a] >= low_[a] + extent_[a]) return false;
    return chosen_[at(k)] != 0;
  }
  /// Adds the cells at most `by` cells along this axis from chosen ones.
  void grow(std::size_t axis, std::int64_t by);
  /// Adds the rest of blocks of this size that have a chosen cell. They begin at the first cell of the mask.
  void fill(const Cells& block);
  /// The box around the chosen cells: its first one, and the end.
  std::pair<Cells, Cells> bounds() const;

 private:
  std::size_t at(const Cells& k) const noexcept {
    return static_cast<std::size_t>(k[0] - low_[0] + extent_[0] * (k[1] - low_[1] + extent_[1] * (k[2] - low_[2])));
  }

  Cells low_, extent_;
  std::vector<std::uint8_t> chosen_;
};

}  // namespace perikit
