#include "setup/surfaces/free_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "body/partition/near_ranks.hpp"
#include "body/points/point_arithmetic.hpp"

namespace perikit {

namespace {

/// Whether there is a point behind the face of the cell of p along an internal axis of the lattice.
bool occupied(const Body& body, std::int32_t p, std::size_t axis, int sign) {
  const Lattice& lattice = *body.lattice();
  std::array<int, 3> step{};
  step[axis] = sign;
  std::array<std::int64_t, 3> cell = lattice.cell(p);
  cell[axis] += sign;
  // A dead cell beyond the last row may be outside of the padding where families have no reach along this axis.
  if (cell[axis] < 0 || cell[axis] >= lattice.extent[axis]) return false;
  return body.alive(static_cast<std::size_t>(p + lattice.shift(step)));
}

std::vector<std::int32_t> free_surface_of_cloud(const Body& body) {
  // Of a part no more than families are there.
  const double reach = std::min(2 * body.spacing(), body.horizon());
  const FamilyLists near = find_families(body.rows(), body.points(), body.dimension(), reach, [&](std::size_t p) { return body.image(p) ? -1 : body.number(p); });
  std::vector<std::int32_t> found;
  for (const std::int32_t p : body.owned()) {
    const auto i = static_cast<std::size_t>(p);
    const Point x = body.position(i);
    const auto vector_to = [&](std::int64_t k) {
      const Point y = body.position(static_cast<std::size_t>(near.neighbour[static_cast<std::size_t>(k)]));
      return y - x;
    };
    Point outward{};
    double volume = 0;
    for (std::int64_t k = near.first[i]; k < near.first[i + 1]; ++k) {
      const Point xi = vector_to(k);
      const double v = body.volume(static_cast<std::size_t>(near.neighbour[static_cast<std::size_t>(k)])),
                   length = std::sqrt(dot(xi, xi));
      for (std::size_t c = 0; c < 3; ++c) outward[c] -= v * xi[c] / length;
      volume += v;
    }
    const double size = std::sqrt(dot(outward, outward));
    bool at_surface =
        size >= 0.15 * volume;  // a half space: 1/2 in 3D, 2/pi in 2D; 0.3 at the inner edge of a quarter that is missing
    for (std::int64_t k = near.first[i]; at_surface && k < near.first[i + 1]; ++k)
      at_surface = dot(vector_to(k), outward) <= 0.5 * body.spacing() * size;
    if (at_surface) found.push_back(p);
  }
  return found;
}

/// The nearest of some points to a place.
class NearestPoints {
 public:
  /// They are looked up in cells of this size [m].
  NearestPoints(std::vector<SurfacePoint> points, double cell);
  /// The share of the chosen ones among them, not farther than `most` [m]; 0 where there is none.
  double chosen_share(const Point& x, double most) const;

 private:
  /// visit(squared distance, point) of all that are not farther than `most`.
  template <class Visit>
  void over_near(const Point& x, double most, Visit&& visit) const;
  std::int64_t key(const std::array<std::int64_t, 3>& cell) const noexcept;
  std::array<std::int64_t, 3> cell_of(const Point& x) const noexcept;

  std::vector<SurfacePoint> points_;
  double cell_;
  Point lower_{};
  std::array<std::int64_t, 3> cells_{1, 1, 1};
  std::vector<std::pair<std::int64_t, std::size_t>> entries_;  ///< (key of the cell, number of the point), ascending
};

NearestPoints::NearestPoints(std::vector<SurfacePoint> points, double cell) : points_(std::move(points)), cell_(cell) {
  Point upper{};
  for (std::size_t c = 0; c < 3; ++c) {
    lower_[c] = std::numeric_limits<double>::infinity();
    upper[c] = -lower_[c];
    for (const SurfacePoint& point : points_) {
      lower_[c] = std::min(lower_[c], point.x[c]);
      upper[c] = std::max(upper[c], point.x[c]);
    }
    if (!points_.empty()) cells_[c] = 1 + static_cast<std::int64_t>((upper[c] - lower_[c]) / cell_);
  }
  for (std::size_t n = 0; n < points_.size(); ++n) entries_.emplace_back(key(cell_of(points_[n].x)), n);
  std::ranges::sort(entries_);
}

std::array<std::int64_t, 3> NearestPoints::cell_of(const Point& x) const noexcept {
  std::array<std::int64_t, 3> cell{};
  for (std::size_t c = 0; c < 3; ++c) cell[c] = static_cast<std::int64_t>(std::floor((x[c] - lower_[c]) / cell_));
  return cell;
}

std::int64_t NearestPoints::key(const std::array<std::int64_t, 3>& cell) const noexcept {
  return cell[0] + cells_[0] * (cell[1] + cells_[1] * cell[2]);
}

template <class Visit>
void NearestPoints::over_near(const Point& x, double most, Visit&& visit) const {
  const std::array<std::int64_t, 3> centre = cell_of(x);
  const auto reach = static_cast<std::int64_t>(std::ceil(most / cell_));
  std::array<std::int64_t, 3> first{}, last{};
  for (std::size_t c = 0; c < 3; ++c) {
    first[c] = std::max<std::int64_t>(0, centre[c] - reach);
    last[c] = std::min(cells_[c] - 1, centre[c] + reach);
  }
  const double farthest = most * most * (1 + 1e-12);
  for (std::int64_t k2 = first[2]; k2 <= last[2]; ++k2)
    for (std::int64_t k1 = first[1]; k1 <= last[1]; ++k1)
      for (std::int64_t k0 = first[0]; k0 <= last[0]; ++k0) {
        const std::int64_t wanted = key({k0, k1, k2});
        for (auto entry = std::lower_bound(entries_.begin(), entries_.end(), std::pair{wanted, std::size_t{0}});
             entry != entries_.end() && entry->first == wanted; ++entry) {
          const SurfacePoint& point = points_[entry->second];
          const Point way{point.x[0] - x[0], point.x[1] - x[1], point.x[2] - x[2]};
          if (const double squared = dot(way, way); squared <= farthest) visit(squared, point);
        }
      }
}

double NearestPoints::chosen_share(const Point& x, double most) const {
  if (points_.empty()) return 0;
  double least = std::numeric_limits<double>::infinity();
  over_near(x, most, [&](double squared, const SurfacePoint&) { least = std::min(least, squared); });
  const double within = std::sqrt(least) + 1e-6 * cell_;   // equally near, but for rounding
  std::int64_t all = 0, chosen = 0;
  over_near(x, most, [&](double squared, const SurfacePoint& point) {
    if (squared > within * within) return;
    ++all;
    chosen += point.chosen;
  });
  return all > 0 ? static_cast<double>(chosen) / static_cast<double>(all) : 0.0;
}

}  // namespace

void over_free_faces(const Body& body, std::span<const std::int32_t> points, const FreeFace& visit) {
  for (const std::int32_t p : points)
    for (std::size_t k = 0; k < static_cast<std::size_t>(body.dimension()); ++k)
      for (const int sign : {-1, 1})
        if (!occupied(body, p, k, sign)) visit(p, static_cast<std::size_t>(body.lattice()->axis[k]), sign);
}

std::vector<std::int32_t> free_surface(const Body& body) {
  if (!body.lattice()) return free_surface_of_cloud(body);
  std::vector<std::int32_t> found;
  over_free_faces(body, body.owned(), [&](std::int32_t p, std::size_t, int) {
    if (found.empty() || found.back() != p) found.push_back(p);   // the faces of a cell come one after the other
  });
  return found;
}

std::vector<PointBelow> points_below(const Body& body, const std::vector<SurfacePoint>& surface, double most, const ImageMap* images,
                                     const std::function<bool(std::int32_t)>& candidate) {
  const NearestPoints nearest(of_ranks_near(body, surface, most * (1 + 1e-9)), 2 * body.spacing());
  std::map<double, std::vector<std::int32_t>> by_share;   // images have the shares of their sources
  for (const std::int32_t p : images ? body.internal() : std::span(body.owned())) {
    const auto i = static_cast<std::size_t>(p);
    if (body.image(i) || !candidate(p)) continue;
    if (const double share = nearest.chosen_share(body.position(i), most); share > 0) by_share[share].push_back(p);
  }
  std::vector<std::uint8_t> complete(body.stride(), 0);
  for (const std::int32_t p : body.complete()) complete[static_cast<std::size_t>(p)] = 1;
  std::vector<PointBelow> found;
  for (auto& [share, points] : by_share) {
    if (images) images->append_images(points);
    for (const std::int32_t p : points)
      if (complete[static_cast<std::size_t>(p)]) found.push_back({p, share});
  }
  std::ranges::sort(found, {}, &PointBelow::p);
  return found;
}

}  // namespace perikit
