#pragma once
/// The rotations and reflections that take a lattice into itself, and what they do to the slots of a family.

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

namespace perikit {

class LatticeSymmetries {
 public:
  /// offsets: of the slots [cells], with all images of each. The first symmetry changes nothing.
  LatticeSymmetries(const std::vector<std::array<int, 3>>& offsets, int dimension) : dimension_(dimension) {
    std::map<std::array<int, 3>, std::size_t> slot_at;
    for (std::size_t s = 0; s < offsets.size(); ++s) slot_at[offsets[s]] = s;
    std::array<int, 3> axis{0, 1, 2};
    do {
      for (int signs = 0; signs < 1 << dimension; ++signs) {
        Turn turn{axis, {1, 1, 1}};
        for (int a = 0; a < dimension; ++a) turn.sign[static_cast<std::size_t>(a)] = signs >> a & 1 ? -1 : 1;
        turns_.push_back(turn);
        std::vector<std::uint16_t>& slots = slots_.emplace_back();
        for (const std::array<int, 3>& offset : offsets) slots.push_back(static_cast<std::uint16_t>(slot_at.at(turn(offset))));
      }
    } while (std::next_permutation(axis.begin(), axis.begin() + dimension));
  }
  std::size_t size() const noexcept { return turns_.size(); }
  /// Where symmetry g takes a slot.
  std::size_t slot(std::size_t g, std::size_t s) const noexcept { return slots_[g][s]; }
  /// The symmetry x -> sign_a x_axis(a).
  std::size_t find(const std::array<int, 3>& axis, const std::array<int, 3>& sign) const noexcept {
    std::size_t first = 0;   // of those with these axes
    while (turns_[first].axis != axis) first += std::size_t{1} << dimension_;
    for (int a = 0; a < dimension_; ++a)
      if (sign[static_cast<std::size_t>(a)] < 0) first += std::size_t{1} << a;
    return first;
  }

 private:
  /// x -> sign_a x_axis(a).
  struct Turn {
    std::array<int, 3> axis, sign;
    std::array<int, 3> operator()(const std::array<int, 3>& x) const noexcept {
      std::array<int, 3> y{};
      for (std::size_t a = 0; a < 3; ++a) y[a] = sign[a] * x[static_cast<std::size_t>(axis[a])];
      return y;
    }
  };

  int dimension_;
  std::vector<Turn> turns_;
  std::vector<std::vector<std::uint16_t>> slots_;
};

}  // namespace perikit
