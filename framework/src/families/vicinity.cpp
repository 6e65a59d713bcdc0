#include "families/vicinity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perikit {

Vicinity::Vicinity(const Body& body) : body_(body), size_(body.horizon() / 3) {
  Point low, high;
  low.fill(std::numeric_limits<double>::max());
  high.fill(std::numeric_limits<double>::lowest());
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], x[a]);
      high[a] = std::max(high[a], x[a]);
    }
  }
  // Bodies whose points lie far apart: larger cells, not more of them than four a point.
  const double most = 4.0 * static_cast<double>(body.points());
  const auto cells = [&] {
    double total = 1;
    for (std::size_t a = 0; a < 3; ++a) total *= std::floor((high[a] - low[a]) / size_) + 1;
    return total;
  };
  while (cells() > std::max(most, 64.0)) size_ *= 2;
  for (std::size_t a = 0; a < 3; ++a) count_[a] = static_cast<std::size_t>((high[a] - low[a]) / size_) + 1;
  const std::size_t total = count_[0] * count_[1] * count_[2];
  cell_.assign(body.stride(), static_cast<std::uint32_t>(total));
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    std::size_t cell = 0;
    for (std::size_t a = 3; a-- > 0;)
      cell = cell * count_[a] + std::min(count_[a] - 1, static_cast<std::size_t>((x[a] - low[a]) / size_));
    cell_[static_cast<std::size_t>(p)] = static_cast<std::uint32_t>(cell);
  }
  in_.assign(total + 1, 0);
}

void Vicinity::clear() {
  std::fill(in_.begin(), in_.end(), std::uint8_t{0});
}

void Vicinity::add(std::span<const std::int32_t> points, int families) {
  added_.assign(in_.size(), 0);
  for (const std::int32_t p : points) added_[cell_[static_cast<std::size_t>(p)]] = 1;
  grow(added_, families);
  for (std::size_t c = 0; c < in_.size(); ++c) in_[c] |= added_[c];
}

void Vicinity::grow(int families) {
  grow(in_, families);
}

/// Axis by axis. Points that are r cells apart along an axis are farther than (r - 1) cells from each other.
void Vicinity::grow(std::vector<std::uint8_t>& cells, int families) {
  const auto reach = static_cast<std::int32_t>(std::min(1e9, families * body_.horizon() / size_)) + 1;
  std::size_t step = 1;  // between next cells along the axis
  for (const std::size_t n : count_) {
    for (std::size_t first = 0; first + 1 < cells.size(); first += n * step) {
      // How far the last mark of each line reaches on, forward and then backward; 2 is a mark that was not there before.
      for (const bool forward : {true, false}) {
        left_.assign(step, 0);
        for (std::size_t k = 0; k < n; ++k) {
          std::uint8_t* const cell = cells.data() + first + (forward ? k : n - 1 - k) * step;
          for (std::size_t i = 0; i < step; ++i) {
            left_[i] = cell[i] == 1 ? reach : left_[i] - 1;
            cell[i] = cell[i] == 0 && left_[i] >= 0 ? 2 : cell[i];
            left_[i] = std::max(left_[i], -1);
          }
        }
      }
    }
    for (std::uint8_t& cell : cells) cell = cell != 0;
    step *= n;
  }
}

GroupMarks Vicinity::groups() const {
  GroupMarks marks(body_.stride() / padding, 0);
  for (std::size_t p = 0; p < body_.stride(); ++p) marks[p / padding] |= in_[cell_[p]];
  return marks;
}

}  // namespace perikit
