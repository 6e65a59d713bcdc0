#pragma once
/// Blocks of points along the curve that orders a cloud, and their colours on ranks that have parts of it.

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "body/points/curve.hpp"

namespace perikit {

/// So many points that follow each other along the curve are one to the colours of blocks, which have a multiple of them: the fewer, the fewer blocks
/// meet, and the fewer colours there are, which are steps that no number of threads shortens.
inline constexpr std::size_t colour_unit = 16;

/// Hands out colours block after block: the first one of which no earlier block touches one of the same units.
class FreeColours {
 public:
  explicit FreeColours(std::size_t units) : units_(units) {}
  template <class Unit>
  std::int32_t next(std::span<const Unit> touches) {
    for (std::size_t layer = 0;; ++layer) {
      if (layer == taken_.size()) taken_.emplace_back(units_, 0);
      std::vector<std::uint64_t>& taken = taken_[layer];
      std::uint64_t all = 0;
      for (const Unit unit : touches) all |= taken[static_cast<std::size_t>(unit)];
      if (all == ~std::uint64_t{0}) continue;
      const int free = std::countr_one(all);
      for (const Unit unit : touches) taken[static_cast<std::size_t>(unit)] |= std::uint64_t{1} << free;
      return static_cast<std::int32_t>(64 * layer) + free;
    }
  }

 private:
  std::size_t units_;
  std::vector<std::vector<std::uint64_t>> taken_;  ///< 64 colours at a time, by unit
};

/// Marks of points, a byte each, by internal index: marks whole blocks of so many where one of them is marked.
void fill_blocks(std::size_t block, std::vector<std::uint8_t>& marked);

/// Gives the blocks of a part of a cloud the colours that they have in the whole body. The colour of a block follows from those
/// before it, so rank 0 finds them, for one rank after the other. All ranks must call it; a rank without others leaves it.
void colour_blocks(const CurveShares& pieces, Body& part);

}  // namespace perikit
