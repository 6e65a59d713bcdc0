#include "body/partition/cloud_shares.hpp"

#include <limits>
#include <unordered_map>
#include <utility>

#include "core/each_once.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

std::size_t rank_count() {
  return static_cast<std::size_t>(communicator().size());
}
std::size_t own_rank() {
  return static_cast<std::size_t>(communicator().rank());
}

/// The lowest coordinates of all points on all ranks.
Point lowest(const std::vector<Point>& positions) {
  Point lower{};
  for (std::size_t c = 0; c < 3; ++c) {
    double least = std::numeric_limits<double>::infinity();
    for (const Point& x : positions) least = std::min(least, x[c]);
    lower[c] = -communicator().largest(-least);
  }
  return lower;
}

}  // namespace

std::vector<std::int64_t> CloudShares::blocks_around(std::span<const OnePoint> points, double radius) const {
  // Points of a cube are asked for together.
  struct Box {
    Point low, high;
  };
  std::unordered_map<std::uint64_t, Box> boxes;
  for (const OnePoint& point : points) {
    Box& box = boxes.try_emplace(curve_.key(point.x), Box{point.x, point.x}).first->second;
    for (std::size_t c = 0; c < 3; ++c) {
      box.low[c] = std::min(box.low[c], point.x[c]);
      box.high[c] = std::max(box.high[c], point.x[c]);
    }
  }
  std::vector<std::uint64_t> wanted;
  for (auto& [key, box] : boxes) {
    for (std::size_t c = 0; c < 3; ++c) {
      box.low[c] -= radius;
      box.high[c] += radius;
    }
    curve_.add_keys(box.low, box.high, wanted);
  }
  keep_each_once(wanted);
  return blocks_with(wanted);
}

/// Points of the rank's run of the input along the curve.
struct SharedCloud::Sorted {
  std::vector<std::pair<std::uint64_t, std::int64_t>> order;  ///< key, and which of the points: as they come by number
  std::int64_t first, real;                                   ///< number of the first point; how many are no images
  const std::vector<std::int64_t>& images;

  Sorted(const Curve& curve, const std::vector<Point>& positions, const std::vector<std::int64_t>& of_images)
      : first(counted(std::ssize(positions) - std::ssize(of_images)).before),
        real(std::ssize(positions) - std::ssize(of_images)),
        images(of_images) {
    order.reserve(positions.size());
    for (const Point& x : positions) order.emplace_back(curve.key(x), std::ssize(order));
    std::ranges::sort(order);
  }
  std::int64_t number(std::int64_t n) const { return n < real ? first + n : images[static_cast<std::size_t>(n - real)]; }
  /// How many come before a place of the curve.
  std::int64_t before(const Start& at) const {
    return std::ranges::lower_bound(order, std::pair(at.key, at.number), {},
                                    [&](const auto& entry) { return std::pair(entry.first, number(entry.second)); }) -
           order.begin();
  }
};

SharedCloud::SharedCloud(PointCloud mine, double cube, std::vector<std::int64_t> images)
    : CloudShares({counted(std::ssize(mine.position)).all, communicator().size()}, {lowest(mine.position), cube}) {
  const Sorted sorted(curve_, mine.position, images);
  starts_ = find_starts(sorted);
  std::vector<Points> to(rank_count());
  for (const auto& [key, at] : sorted.order) {
    const auto n = static_cast<std::size_t>(at);
    const std::int64_t number = sorted.number(at);
    to[holder({key, number})].push_back({mine.position[n], mine.volume[n], number});
  }
  mine = {};
  for (const Points& points : exchanged(to)) held_.insert(held_.end(), points.begin(), points.end());
  to = {};
  std::ranges::sort(held_, {}, [&](const OnePoint& point) { return std::pair(curve_.key(point.x), point.number); });
  keys_.reserve(held_.size());
  for (const OnePoint& point : held_) keys_.push_back(curve_.key(point.x));
  if (communicator().complete()) first_held_ = pieces_.first(communicator().rank());
}

/// Bit by bit, all pieces at once: the last place of the curve before which there are no more points than come before the piece.
std::vector<SharedCloud::Start> SharedCloud::find_starts(const Sorted& mine) const {
  std::vector<Start> starts(rank_count(), Start{0, 0});
  const auto try_bits = [&](auto&& with_bit) {
    std::vector<std::int64_t> before;
    for (const Start& start : starts) before.push_back(mine.before(with_bit(start)));
    communicator().sum(before);
    for (std::size_t r = 1; r < starts.size(); ++r)  // the first piece begins with the curve
      if (before[r] <= pieces_.first(static_cast<std::int64_t>(r))) starts[r] = with_bit(starts[r]);
  };
  for (int bit = 62; bit >= 0; --bit) try_bits([&](const Start& start) { return Start{start.key | std::uint64_t{1} << bit, 0}; });
  for (int bit = 62; bit >= 0; --bit)
    try_bits([&](const Start& start) { return Start{start.key, start.number | std::int64_t{1} << bit}; });
  return starts;
}

std::size_t SharedCloud::holder(const Start& at) const noexcept {
  if (!communicator().complete()) return own_rank();
  const auto place = [](const Start& start) { return std::pair(start.key, start.number); };
  return static_cast<std::size_t>(std::ranges::upper_bound(starts_, place(at), {}, place) - starts_.begin() - 1);
}

std::size_t SharedCloud::holder_of_block(std::int64_t block) const noexcept {
  return communicator().complete() ? static_cast<std::size_t>(pieces_.owner_of_block(block)) : own_rank();
}

std::span<const CloudShares::OnePoint> SharedCloud::held_block(std::int64_t block) const noexcept {
  const std::int64_t first = block * pieces_.block(), last = std::min(pieces_.points(), first + pieces_.block());
  return std::span(held_).subspan(static_cast<std::size_t>(first - first_held_), static_cast<std::size_t>(last - first));
}

std::span<const CloudShares::OnePoint> SharedCloud::own() const noexcept {
  const std::int64_t rank = communicator().rank(), first = pieces_.first(rank);
  return std::span(held_).subspan(static_cast<std::size_t>(first - first_held_),
                                  static_cast<std::size_t>(pieces_.first(rank + 1) - first));
}

std::vector<std::int64_t> SharedCloud::blocks_with(const std::vector<std::uint64_t>& keys) const {
  std::vector<std::vector<std::uint64_t>> asked(rank_count());
  for (const std::uint64_t key : keys)
    for (std::size_t r = holder({key, 0}); r <= holder({key, std::numeric_limits<std::int64_t>::max()}); ++r)
      asked[r].push_back(key);
  std::vector<std::vector<std::int64_t>> found(rank_count());
  const std::vector<std::vector<std::uint64_t>> asked_here = exchanged(asked);
  for (std::size_t r = 0; r < asked_here.size(); ++r) {
    auto from = keys_.begin();
    for (const std::uint64_t key : asked_here[r]) {
      from = std::lower_bound(from, keys_.end(), key);
      for (auto at = from; at != keys_.end() && *at == key;) {
        const std::int64_t block = pieces_.block_of(first_held_ + (at - keys_.begin()));
        if (found[r].empty() || found[r].back() != block) found[r].push_back(block);
        at = keys_.begin() + std::min(std::ssize(keys_), pieces_.block() * (block + 1) - first_held_);
      }
    }
  }
  std::vector<std::int64_t> blocks;
  for (const std::vector<std::int64_t>& of_rank : exchanged(found)) blocks.insert(blocks.end(), of_rank.begin(), of_rank.end());
  keep_each_once(blocks);
  return blocks;
}

std::map<std::int64_t, CloudShares::Points> SharedCloud::fetch(const std::vector<std::int64_t>& blocks) const {
  std::vector<std::vector<std::int64_t>> asked(rank_count());
  for (const std::int64_t block : blocks) asked[holder_of_block(block)].push_back(block);
  std::vector<Points> answers(rank_count());
  const std::vector<std::vector<std::int64_t>> asked_here = exchanged(asked);
  for (std::size_t r = 0; r < asked_here.size(); ++r)
    for (const std::int64_t block : asked_here[r]) {
      const std::span<const OnePoint> points = held_block(block);
      answers[r].insert(answers[r].end(), points.begin(), points.end());
    }
  std::map<std::int64_t, Points> fetched;
  const std::vector<Points> got = exchanged(answers);
  for (std::size_t r = 0; r < got.size(); ++r) {
    auto next = got[r].begin();
    for (const std::int64_t block : asked[r]) {
      const auto end = next + std::min(pieces_.block(), got[r].end() - next);
      fetched.emplace(block, Points(next, end));
      next = end;
    }
  }
  return fetched;
}

}  // namespace perikit
