#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>

#include "body/family_limit.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

/// Boxes of at least one horizon a side over the points, with the points sorted by box.
struct CellList {
  Point lower{};
  double size = 0;
  std::array<std::int64_t, 3> count{1, 1, 1};
  std::vector<std::int32_t> first;   ///< by box
  std::vector<std::int32_t> points;

  CellList(std::span<const double> rows, std::size_t n, int dimension, double horizon) {
    Point upper{};
    for (std::size_t c = 0; c < 3; ++c) {
      lower[c] = upper[c] = rows[c];
      for (std::size_t p = 0; p < n; ++p) {
        lower[c] = std::min(lower[c], rows[4 * p + c]);
        upper[c] = std::max(upper[c], rows[4 * p + c]);
      }
    }
    // Sparse bodies: larger boxes, so that their number stays below that of the points.
    size = search_radius(horizon);
    for (;; size *= 2) {
      double boxes = 1;
      for (int c = 0; c < dimension; ++c) boxes *= std::floor((upper[c] - lower[c]) / size) + 1;
      if (boxes <= 2.0 * static_cast<double>(n) + 64) break;
    }
    for (int c = 0; c < dimension; ++c) count[c] = static_cast<std::int64_t>((upper[c] - lower[c]) / size) + 1;
    std::vector<std::int32_t> box(n);
    first.assign(static_cast<std::size_t>(count[0] * count[1] * count[2] + 1), 0);
    for (std::size_t p = 0; p < n; ++p) {
      box[p] = static_cast<std::int32_t>(flat(of(&rows[4 * p])));
      ++first[static_cast<std::size_t>(box[p]) + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    points.resize(n);
    std::vector<std::int32_t> next(first.begin(), first.end() - 1);
    for (std::size_t p = 0; p < n; ++p) points[static_cast<std::size_t>(next[static_cast<std::size_t>(box[p])]++)] = static_cast<std::int32_t>(p);
  }

  std::array<std::int64_t, 3> of(const double* x) const {
    std::array<std::int64_t, 3> k{};
    for (std::size_t c = 0; c < 3; ++c) k[c] = std::clamp<std::int64_t>(static_cast<std::int64_t>((x[c] - lower[c]) / size), 0, count[c] - 1);
    return k;
  }
  std::int64_t flat(const std::array<std::int64_t, 3>& k) const { return k[0] + count[0] * (k[1] + count[1] * k[2]); }

  /// The box at this place in the list.
  std::array<std::int64_t, 3> at(std::int64_t box) const {
    return {box % count[0], box / count[0] % count[1], box / count[0] / count[1]};
  }

  template <class Visit>
  void around(const double* x, Visit&& visit) const {
    around(of(x), visit);
  }
  template <class Visit>
  void around(const std::array<std::int64_t, 3>& k, Visit&& visit) const {
    for (std::int64_t c = std::max<std::int64_t>(k[2] - 1, 0); c <= std::min(k[2] + 1, count[2] - 1); ++c)
      for (std::int64_t b = std::max<std::int64_t>(k[1] - 1, 0); b <= std::min(k[1] + 1, count[1] - 1); ++b) {
        const auto begin = static_cast<std::size_t>(flat({std::max<std::int64_t>(k[0] - 1, 0), b, c}));
        const auto end = static_cast<std::size_t>(flat({std::min(k[0] + 1, count[0] - 1), b, c}));
        for (std::int32_t i = first[begin]; i < first[end + 1]; ++i) visit(points[static_cast<std::size_t>(i)]);
      }
  }
};

/// The points of a box and of those around it, ascending, with their places by component.
class PointsAround {
 public:
  void collect(const CellList& cells, std::span<const double> rows, std::size_t box) {
    points_.clear();
    const std::array<std::int64_t, 3> k = cells.at(static_cast<std::int64_t>(box));
    cells.around(k, [&](std::int32_t q) { points_.push_back(q); });
    std::sort(points_.begin(), points_.end());
    for (std::size_t c = 0; c < 3; ++c) {
      place_[c].assign(padded(points_.size()), std::numeric_limits<double>::infinity());  // those that fill the last pack are far away
      for (std::size_t i = 0; i < points_.size(); ++i) place_[c][i] = rows[4 * static_cast<std::size_t>(points_[i]) + c];
    }
  }
  /// How many are within `limit` of x and farther than `coincident`.
  std::int64_t count(const double* x, double limit, double coincident) const noexcept {
    const Pack least(coincident * coincident);
    std::int64_t n = 0;
    over_near(x, limit, [&](std::size_t, std::uint32_t bits, Pack r2) { n += std::popcount(bits & ~lane_bits(r2 <= least)); });
    return n;
  }
  /// Writes those that are. same_place(q): called for each that lies within `coincident`, x itself among them.
  template <class SamePlace>
  void list(const double* x, double limit, double coincident, std::int32_t* out, SamePlace&& same_place) const {
    const Pack least(coincident * coincident);
    over_near(x, limit, [&](std::size_t first, std::uint32_t bits, Pack r2) {
      const auto point = [&](std::uint32_t of) { return points_[first + static_cast<std::size_t>(std::countr_zero(of))]; };
      std::uint32_t same = lane_bits(r2 <= least);
      bits &= ~same;
      for (; same != 0; same &= same - 1) same_place(point(same));
      for (; bits != 0; bits &= bits - 1) *out++ = point(bits);
    });
  }

 private:
  template <class Visit>
  void over_near(const double* x, double limit, Visit&& visit) const noexcept {
    const Pack square(limit * limit);
    for (std::size_t i = 0; i < points_.size(); i += pack_width) {
      Pack r2(0.0);
      for (std::size_t c = 0; c < 3; ++c) {
        const Pack d = Pack::load(place_[c].data() + i) - Pack(x[c]);
        r2 += d * d;
      }
      if (const std::uint32_t bits = lane_bits(r2 <= square)) visit(i, bits, r2);
    }
  }

  std::vector<std::int32_t> points_;
  AlignedVector<double> place_[3];
};

double squared_distance(std::span<const double> rows, std::size_t p, std::size_t q) {
  double r2 = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double d = rows[4 * q + c] - rows[4 * p + c];
    r2 += d * d;
  }
  return r2;
}

}  // namespace

CoincidentPoints::CoincidentPoints(std::int64_t number, const Point& x)
    : std::domain_error(
          fmt::format("found two points at ({:.6g}, {:.6g}, {:.6g}); allowed: points at different places", x[0], x[1], x[2])),
      number_(number) {}

FamilyLists find_families(std::span<const double> rows, std::size_t points, int dimension, double horizon,
                          const std::function<std::int64_t(std::size_t p)>& number) {
  const CellList cells(rows, points, dimension, horizon);
  const double limit = family_limit(horizon), coincident = 1e-12 * horizon;
  // The points of a box look through the same others, eight at a time.
  const auto over_points = [&](auto&& found) {
    constexpr std::size_t piece = 64;
    const std::size_t boxes = cells.first.size() - 1;
    parallel_for((boxes + piece - 1) / piece, [&](std::size_t b) {
      PointsAround around;
      for (std::size_t box = b * piece; box < std::min(boxes, (b + 1) * piece); ++box) {
        if (cells.first[box] == cells.first[box + 1]) continue;
        around.collect(cells, rows, box);
        for (std::int32_t i = cells.first[box]; i < cells.first[box + 1]; ++i) found(static_cast<std::size_t>(cells.points[static_cast<std::size_t>(i)]), around);
      }
    });
  };
  FamilyLists lists;
  lists.first.assign(points + 1, 0);
  over_points([&](std::size_t p, const PointsAround& around) { lists.first[p + 1] = around.count(&rows[4 * p], limit, coincident); });
  std::partial_sum(lists.first.begin(), lists.first.end(), lists.first.begin());
  lists.neighbour.resize(static_cast<std::size_t>(lists.first.back()));
  std::mutex one;
  std::optional<CoincidentPoints> twice;
  over_points([&](std::size_t p, const PointsAround& around) {
    int same_place = 0;
    const auto number_of = [&](std::size_t q) { return number ? number(q) : static_cast<std::int64_t>(q); };
    around.list(&rows[4 * p], limit, coincident, lists.neighbour.data() + lists.first[p],
                [&](std::int32_t q) { same_place += q == static_cast<std::int32_t>(p) || number_of(static_cast<std::size_t>(q)) >= 0; });
    const std::int64_t found = number_of(p);
    if (same_place < 2 || found < 0) return;
    const std::lock_guard lock(one);
    if (!twice || found < twice->number()) twice.emplace(found, Point{rows[4 * p], rows[4 * p + 1], rows[4 * p + 2]});
  });
  if (twice) throw *twice;
  return lists;
}

std::vector<std::uint8_t> with_families(std::span<const double> rows, std::size_t points, int dimension, double horizon,
                                        std::vector<std::uint8_t> from) {
  const CellList cells(rows, points, dimension, horizon);
  const double limit = family_limit(horizon);
  std::vector<std::uint8_t> reached = from;
  constexpr std::size_t block = 1024;
  parallel_for((points + block - 1) / block, [&](std::size_t b) {
    for (std::size_t p = b * block; p < std::min(points, (b + 1) * block); ++p) {
      if (from[p]) continue;
      cells.around(&rows[4 * p], [&](std::int32_t q) {
        if (from[static_cast<std::size_t>(q)] && squared_distance(rows, p, static_cast<std::size_t>(q)) <= limit * limit)
          reached[p] = 1;
      });
    }
  });
  return reached;
}

std::vector<std::vector<std::int32_t>> block_reach(const Body& body, std::size_t unit, std::size_t first, std::size_t last) {
  const std::span<const double> rows = body.rows();
  const std::size_t points = body.points();
  const CellList cells(rows, points, body.dimension(), body.horizon());
  const double limit = family_limit(body.horizon());
  const std::size_t block = body.block_points();
  std::vector<std::vector<std::int32_t>> touches(last - first);
  std::vector<std::vector<std::size_t>> found(static_cast<std::size_t>(thread_count()));  // by unit: one more than the block that has it last
  parallel_for(touches.size(), [&](std::size_t k) {
    const std::size_t b = first + k;
    std::vector<std::size_t>& last_of = found[static_cast<std::size_t>(thread_index())];
    last_of.resize((points + unit - 1) / unit);
    const auto add = [&](std::size_t p) {
      last_of[p / unit] = b + 1;
      touches[k].push_back(static_cast<std::int32_t>(p / unit));
    };
    for (std::size_t p = b * block; p < std::min(points, (b + 1) * block); p += unit) add(p);
    for (std::size_t p = b * block; p < std::min(points, (b + 1) * block); ++p)
      cells.around(&rows[4 * p], [&](std::int32_t far) {
        const auto q = static_cast<std::size_t>(far);
        if (last_of[q / unit] == b + 1 || squared_distance(rows, p, q) > limit * limit) return;
        if (!body.cut(body.position(p), body.position(q))) add(q);
      });
  });
  return touches;
}

}  // namespace perikit
