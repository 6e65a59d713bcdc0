#include "body/partition/streamed_cloud.hpp"

#include <algorithm>
#include <bit>
#include <compare>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "perikit/core/exact_sum.hpp"

namespace perikit {

namespace {

/// A point and where it comes along the curve.
struct Keyed {
  std::uint64_t key;
  CloudShares::OnePoint point;
  friend auto operator<=>(const Keyed& a, const Keyed& b) {
    return std::pair(a.key, a.point.number) <=> std::pair(b.key, b.point.number);
  }
};

/// The first `most` of all points that it is shown, in the order of `Before`.
template <class Before>
class First {
 public:
  explicit First(std::int64_t most = 0) : most_(most) {}
  void show(const Keyed& point) {
    if (most_ == 0 || (std::ssize(heap_) == most_ && !Before()(point, heap_.front()))) return;
    if (std::ssize(heap_) == most_) {
      std::pop_heap(heap_.begin(), heap_.end(), Before());
      heap_.pop_back();
    }
    heap_.push_back(point);
    std::push_heap(heap_.begin(), heap_.end(), Before());
  }
  const std::vector<Keyed>& points() const noexcept { return heap_; }

 private:
  std::int64_t most_;
  std::vector<Keyed> heap_;  ///< the last one first
};

/// In which slot a key lies. Points that follow each other in the input often lie in the same one.
class Slots {
 public:
  explicit Slots(const std::vector<std::uint64_t>& keys) : keys_(keys) {}
  std::size_t of(std::uint64_t key) {
    if (key >= low_ && key < high_) return slot_;
    const auto at = std::lower_bound(keys_.begin(), keys_.end(), key);
    const bool cube = at != keys_.end() && *at == key;
    slot_ = 2 * static_cast<std::size_t>(at - keys_.begin()) + cube;
    low_ = cube ? key : at == keys_.begin() ? 0 : at[-1] + 1;
    high_ = cube ? key + 1 : at == keys_.end() ? std::numeric_limits<std::uint64_t>::max() : *at;
    return slot_;
  }

 private:
  const std::vector<std::uint64_t>& keys_;
  std::uint64_t low_ = 0, high_ = 0;
  std::size_t slot_ = 0;
};

/// What is wanted of a slot: points at its beginning and at its end.
struct Wanted {
  First<std::less<>> begin;
  First<std::greater<>> end;
};

}  // namespace

CloudExtent extent_of(const PointStream& all) {
  CloudExtent extent;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  extent.lower.fill(infinity);
  extent.upper.fill(-infinity);
  ExactSum volume;
  all([&](const CloudShares::OnePoint& point) {
    ++extent.points;
    for (std::size_t c = 0; c < 3; ++c) {
      extent.lower[c] = std::min(extent.lower[c], point.x[c]);
      extent.upper[c] = std::max(extent.upper[c], point.x[c]);
    }
    volume.add(point.volume);
  });
  extent.volume = volume.value();
  return extent;
}

template <class Visit>
void StreamedCloud::over_points(Visit&& visit) const {
  all_([&](const OnePoint& point) { visit(curve_.key(point.x), point); });
}

/// By the leading bits of the keys, then by further ones.
void StreamedCloud::find_cubes(std::uint64_t largest, std::array<Holder, 2>& wanted) const {
  constexpr int most = 21;  // bits at a time, for which there are counts
  for (int bits = static_cast<int>(std::bit_width(largest)); bits > 0;) {
    const int below = std::max(0, bits - most);
    const std::uint64_t digits = std::uint64_t{1} << (bits - below);
    std::array<std::vector<std::int64_t>, 2> counts;
    for (std::vector<std::int64_t>& of : counts) of.assign(digits, 0);
    over_points([&](std::uint64_t key, const OnePoint&) {
      for (std::size_t k = 0; k < wanted.size(); ++k)
        if (key >> bits == wanted[k].key >> bits) ++counts[k][(key >> below) % digits];
    });
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      std::uint64_t digit = 0;
      for (; wanted[k].before + counts[k][digit] <= wanted[k].place; ++digit) wanted[k].before += counts[k][digit];
      wanted[k].key |= digit << below;
    }
    bits = below;
  }
}

StreamedCloud::StreamedCloud(PointStream all, const CloudExtent& extent, double cube)
    : CloudShares({extent.points, communicator().size()}, {extent.lower, cube}), all_(std::move(all)) {
  const std::int64_t first = first_own(), end = pieces_.first(communicator().rank() + 1);
  if (first == end) return;
  std::array<Holder, 2> ends{Holder{first}, Holder{end - 1}};
  find_cubes(curve_.key(extent.upper), ends);
  std::vector<Keyed> points;
  over_points([&](std::uint64_t key, const OnePoint& point) {
    if (key >= ends[0].key && key <= ends[1].key) points.push_back({key, point});
  });
  std::sort(points.begin(), points.end());
  const std::int64_t before = ends[0].before;
  for (std::int64_t place = first; place < end; ++place) own_.push_back(points[static_cast<std::size_t>(place - before)].point);
}

std::vector<std::int64_t> StreamedCloud::blocks_with(const std::vector<std::uint64_t>& keys) const {
  keys_ = keys;
  first_of_slot_.assign(2 * keys.size() + 2, 0);
  Slots slots(keys_);
  over_points([&](std::uint64_t key, const OnePoint&) { ++first_of_slot_[slots.of(key) + 1]; });
  std::partial_sum(first_of_slot_.begin(), first_of_slot_.end(), first_of_slot_.begin());
  std::vector<std::int64_t> blocks;
  for (std::size_t s = 1; s + 1 < first_of_slot_.size(); s += 2) {
    if (first_of_slot_[s] == first_of_slot_[s + 1]) continue;
    const std::int64_t last = pieces_.block_of(first_of_slot_[s + 1] - 1);
    for (std::int64_t block = pieces_.block_of(first_of_slot_[s]); block <= last; ++block)
      if (blocks.empty() || blocks.back() != block) blocks.push_back(block);
  }
  return blocks;
}

std::map<std::int64_t, CloudShares::Points> StreamedCloud::fetch(const std::vector<std::int64_t>& blocks) const {
  // Each block holds a point of one of the cubes: between two of these it begins at one or ends at the other.
  const auto wanted_block = [&](std::int64_t block) { return std::binary_search(blocks.begin(), blocks.end(), block); };
  const std::int64_t size = pieces_.block();
  std::vector<Wanted> wanted;
  for (std::size_t s = 0; s + 1 < first_of_slot_.size(); ++s) {
    const std::int64_t first = first_of_slot_[s], last = first_of_slot_[s + 1], of_first = pieces_.block_of(first),
                       of_last = pieces_.block_of(last);
    std::int64_t at_begin = 0, at_end = 0;
    if (s % 2 == 1) {
      at_begin = last - first;
    } else {
      if (first % size != 0 && wanted_block(of_first)) at_begin = std::min(last, (of_first + 1) * size) - first;
      if (last % size != 0 && wanted_block(of_last))
        at_end = std::min(last - std::max(first, of_last * size), last - first - at_begin);
    }
    wanted.push_back({First<std::less<>>(at_begin), First<std::greater<>>(at_end)});
  }
  Slots slots(keys_);
  over_points([&](std::uint64_t key, const OnePoint& point) {
    Wanted& of = wanted[slots.of(key)];
    of.begin.show({key, point});
    of.end.show({key, point});
  });
  std::map<std::int64_t, Points> fetched;
  const auto take = [&](std::vector<Keyed> points, std::int64_t place) {
    std::sort(points.begin(), points.end());
    for (const Keyed& found : points)
      if (const std::int64_t block = pieces_.block_of(place++); wanted_block(block)) fetched[block].push_back(found.point);
  };
  for (std::size_t s = 0; s < wanted.size(); ++s) {
    take(wanted[s].begin.points(), first_of_slot_[s]);
    take(wanted[s].end.points(), first_of_slot_[s + 1] - std::ssize(wanted[s].end.points()));
  }
  return fetched;
}

}  // namespace perikit
