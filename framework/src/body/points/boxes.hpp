#pragma once
/// Places in boxes, for what lies near a place.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "body/points/point_arithmetic.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

/// Places in boxes of one size, box by box.
class Boxes {
 public:
  /// from: where boxes begin, below all places; null: at the lowest of them.
  Boxes(std::vector<Point> places, double size, const Point* from = nullptr)
      : place_(std::move(places)), size_(size), order_(place_.size()) {
    if (place_.empty()) return;
    Point lower = place_.front(), upper = lower;
    for (const Point& x : place_)
      for (std::size_t c = 0; c < 3; ++c) {
        lower[c] = std::min(lower[c], x[c]);
        upper[c] = std::max(upper[c], x[c]);
      }
    lower_ = from ? *from : lower;
    for (std::size_t c = 0; c < 3; ++c) count_[c] = static_cast<std::int64_t>((upper[c] - lower_[c]) / size) + 1;
    std::vector<std::int64_t> box(place_.size());
    parallel_for(box.size(), [&](std::size_t n) { box[n] = number(cell(place_[n])); });
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
      return std::pair(box[static_cast<std::size_t>(a)], a) < std::pair(box[static_cast<std::size_t>(b)], b);
    });
    key_.reserve(order_.size());
    for (const std::int32_t n : order_) key_.push_back(box[static_cast<std::size_t>(n)]);
  }

  const Point& place(std::size_t n) const noexcept { return place_[n]; }
  std::size_t size() const noexcept { return place_.size(); }

  /// By place: whether what lies in its box and those around it has different values. Different boxes are at least one size
  /// apart.
  std::vector<std::uint8_t> differing(std::span<const std::uint16_t> value) const {
    struct Range {
      std::int64_t box;
      std::uint16_t least, most;
    };
    std::vector<Range> boxes;
    std::vector<std::size_t> box_of(order_.size());
    for (std::size_t at = 0; at < order_.size(); ++at) {
      const std::uint16_t own = value[static_cast<std::size_t>(order_[at])];
      if (boxes.empty() || boxes.back().box != key_[at]) boxes.push_back({key_[at], own, own});
      boxes.back().least = std::min(boxes.back().least, own);
      boxes.back().most = std::max(boxes.back().most, own);
      box_of[at] = boxes.size() - 1;
    }
    std::vector<std::uint8_t> differ(boxes.size());
    parallel_for(boxes.size(), [&](std::size_t b) {
      const std::int64_t row = boxes[b].box / count_[0];
      const std::array<std::int64_t, 3> k{boxes[b].box % count_[0], row % count_[1], row / count_[1]};
      std::uint16_t least = boxes[b].least, most = boxes[b].most;
      over_rows(k, k, 1, [&](std::int64_t from, std::int64_t to) {
        for (auto at = std::ranges::lower_bound(boxes, from, {}, &Range::box); at != boxes.end() && at->box <= to; ++at) {
          least = std::min(least, at->least);
          most = std::max(most, at->most);
        }
      });
      differ[b] = least != most;
    });
    std::vector<std::uint8_t> of_place(order_.size());
    for (std::size_t at = 0; at < order_.size(); ++at) of_place[static_cast<std::size_t>(order_[at])] = differ[box_of[at]];
    return of_place;
  }

  /// visit(n, square of the distance) for all places no farther than `radius` from x, in an order that depends on the places
  /// alone.
  template <class Visit>
  void near(const Point& x, double radius, Visit&& visit) const {
    if (place_.empty()) return;
    over_rows(cell({x[0] - radius, x[1] - radius, x[2] - radius}), cell({x[0] + radius, x[1] + radius, x[2] + radius}), 0,
              [&](std::int64_t from, std::int64_t to) {
                for (auto at = std::lower_bound(key_.begin(), key_.end(), from); at != key_.end() && *at <= to; ++at) {
                  const auto n = static_cast<std::size_t>(order_[static_cast<std::size_t>(at - key_.begin())]);
                  const Point d = place_[n] - x;
                  if (const double square = dot(d, d); square <= radius * radius) visit(n, square);
                }
              });
  }

 private:
  /// visit(first, last) the boxes of each row that lies between two boxes, and `more` of them on every side: along the first axis
  /// they follow each other.
  template <class Visit>
  void over_rows(std::array<std::int64_t, 3> first, std::array<std::int64_t, 3> last, std::int64_t more, Visit&& visit) const {
    for (std::size_t c = 0; c < 3; ++c) {
      first[c] = std::max<std::int64_t>(0, first[c] - more);
      last[c] = std::min(count_[c] - 1, last[c] + more);
    }
    if (first[0] > last[0]) return;
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y) {
        const std::int64_t from = number({first[0], y, z});
        visit(from, from + last[0] - first[0]);
      }
  }

  std::int64_t index(double x, std::size_t c) const noexcept {
    return static_cast<std::int64_t>(std::floor((x - lower_[c]) / size_));
  }
  std::array<std::int64_t, 3> cell(const Point& x) const noexcept { return {index(x[0], 0), index(x[1], 1), index(x[2], 2)}; }
  std::int64_t number(const std::array<std::int64_t, 3>& k) const noexcept {
    return k[0] + count_[0] * (k[1] + count_[1] * k[2]);
  }

  std::vector<Point> place_;
  double size_;
  Point lower_{};
  std::array<std::int64_t, 3> count_{1, 1, 1};
  std::vector<std::int32_t> order_;
  std::vector<std::int64_t> key_;
};

}  // namespace perikit
