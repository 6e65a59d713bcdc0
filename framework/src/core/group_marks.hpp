#pragma once
/// Which points something has to be evaluated at.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "perikit/core/field.hpp"

namespace perikit {

/// One byte by group of eight points (internal index / 8), bit l for point l of the group. Loops over lattices evaluate whole groups, all of whose bits are set.
using GroupMarks = std::vector<std::uint8_t>;
constexpr std::uint8_t whole_group = 0xff;

inline bool marked(const std::uint8_t* marks, std::size_t p) noexcept { return marks[p / padding] >> p % padding & 1; }
inline bool marked(const GroupMarks& marks, std::size_t p) noexcept { return marked(marks.data(), p); }
inline void mark(GroupMarks& marks, std::size_t p) noexcept { marks[p / padding] |= static_cast<std::uint8_t>(1u << p % padding); }

/// Marks whole runs of so many groups where a point of the run is marked.
inline void mark_whole_runs(std::size_t groups, GroupMarks& marks) noexcept {
  for (std::size_t first = 0; first < marks.size(); first += groups) {
    const std::size_t end = std::min(marks.size(), first + groups);
    bool any = false;
    for (std::size_t g = first; g < end; ++g) any |= marks[g] != 0;
    for (std::size_t g = first; g < end && any; ++g) marks[g] = whole_group;
  }
}
inline void add(GroupMarks& marks, const GroupMarks& others) noexcept {
  for (std::size_t g = 0; g < marks.size(); ++g) marks[g] |= others[g];
}
inline std::size_t count(const GroupMarks& marks) noexcept {
  std::size_t points = 0;
  for (const std::uint8_t bits : marks) points += static_cast<std::size_t>(std::popcount(bits));
  return points;
}

}  // namespace perikit
