#pragma once
/// Blocks of points along the curve that orders a cloud, and their colours on ranks that have parts of it.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "body/curve.hpp"

namespace perikit {

/// Hands out colours block after block: the first one of which no earlier block touches one of the same units.
class FreeColours {
 public:
  explicit FreeColours(std::size_t units) : units_(units) {}
  template <class Unit>
  std::int32_t next(std::span<const Unit> touches) {
    const auto free = std::ranges::find_if(used_, [&](const std::vector<bool>& taken) {
      return std::ranges::none_of(touches, [&](Unit unit) { return taken[static_cast<std::size_t>(unit)]; });
    });
    const std::size_t colour = static_cast<std::size_t>(free - used_.begin());
    if (free == used_.end()) used_.emplace_back(units_, false);
    for (const Unit unit : touches) used_[colour][static_cast<std::size_t>(unit)] = true;
    return static_cast<std::int32_t>(colour);
  }

 private:
  std::size_t units_;
  std::vector<std::vector<bool>> used_;  ///< by colour and unit
};

/// Marks of points, or of groups of them, by internal index: marks whole blocks of so many where one of them is marked.
void fill_blocks(std::size_t block, std::vector<std::uint8_t>& marked);

/// Gives the blocks of a part of a cloud the colours that they have in the whole body. The colour of a block follows from those
/// before it, so rank 0 finds them, for one rank after the other. All ranks must call it; a rank without others leaves it.
void colour_blocks(const CurveShares& pieces, Body& part);

}  // namespace perikit
