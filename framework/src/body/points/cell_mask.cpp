#include "body/points/cell_mask.hpp"

#include <algorithm>

#include "perikit/core/parallel.hpp"

namespace perikit {

CellMask::CellMask(const Cells& low, const Cells& high) : low_(low), extent_(high) {
  for (std::size_t a = 0; a < 3; ++a) extent_[a] -= low[a];
  chosen_.assign(static_cast<std::size_t>(extent_[0] * extent_[1] * extent_[2]), 0);
}

void CellMask::add(const Cells& low, const Cells& high) {
  for (std::int64_t k2 = low[2]; k2 < high[2]; ++k2)
    for (std::int64_t k1 = low[1]; k1 < high[1] && low[0] < high[0]; ++k1)
      std::fill_n(chosen_.begin() + static_cast<std::ptrdiff_t>(at({low[0], k1, k2})), high[0] - low[0], std::uint8_t{1});
}

void CellMask::grow(std::size_t axis, std::int64_t by) {
  constexpr std::uint8_t added = 2;
  const std::size_t across = axis == 0 ? 1 : 0, beyond = axis == 2 ? 1 : 2;
  parallel_for(static_cast<std::size_t>(extent_[across] * extent_[beyond]), [&](std::size_t line) {
    Cells k{};
    k[across] = low_[across] + static_cast<std::int64_t>(line) % extent_[across];
    k[beyond] = low_[beyond] + static_cast<std::int64_t>(line) / extent_[across];
    std::int64_t left = 0;  // cells that are still near the last chosen one
    const auto visit = [&](std::int64_t along) {
      k[axis] = along;
      std::uint8_t& cell = chosen_[at(k)];
      if (cell == 1)
        left = by;
      else if (left-- > 0)
        cell = added;
    };
    const std::int64_t first = low_[axis], last = first + extent_[axis];
    for (std::int64_t along = first; along < last; ++along) visit(along);
    left = 0;
    for (std::int64_t along = last; along-- > first;) visit(along);
    for (k[axis] = first; k[axis] < last; ++k[axis])
      if (std::uint8_t& cell = chosen_[at(k)]; cell == added) cell = 1;
  });
}

void CellMask::fill(const Cells& block) {
  Cells low = low_;
  const auto last = [&](std::size_t a) { return low_[a] + extent_[a]; };
  const auto end = [&](std::size_t a) { return std::min(last(a), low[a] + block[a]); };
  const auto any = [&] {
    for (std::int64_t k2 = low[2]; k2 < end(2); ++k2)
      for (std::int64_t k1 = low[1]; k1 < end(1); ++k1) {
        const auto row = chosen_.begin() + static_cast<std::ptrdiff_t>(at({low[0], k1, k2}));
        if (std::find(row, row + end(0) - low[0], 1) != row + end(0) - low[0]) return true;
      }
    return false;
  };
  for (low[2] = low_[2]; low[2] < last(2); low[2] += block[2])
    for (low[1] = low_[1]; low[1] < last(1); low[1] += block[1])
      for (low[0] = low_[0]; low[0] < last(0); low[0] += block[0])
        if (any()) add(low, {end(0), end(1), end(2)});
}

std::pair<CellMask::Cells, CellMask::Cells> CellMask::bounds() const {
  Cells low, high = low_, k{};
  for (std::size_t a = 0; a < 3; ++a) low[a] = low_[a] + extent_[a];
  for (k[2] = low_[2]; k[2] < low_[2] + extent_[2]; ++k[2])
    for (k[1] = low_[1]; k[1] < low_[1] + extent_[1]; ++k[1])
      for (k[0] = low_[0]; k[0] < low_[0] + extent_[0]; ++k[0]) {
        if (!holds(k)) continue;
        for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], k[a]), high[a] = std::max(high[a], k[a] + 1);
      }
  return {low, high};
}

}  // namespace perikit
