#include "setup/surfaces/held_surfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "body/images/image_list.hpp"
#include "body/points/level_surface.hpp"
#include "body/points/points_at_surface.hpp"
#include "perikit/core/rank_values.hpp"
#include "setup/conditions.hpp"

namespace perikit {

namespace {

std::string place(const Point& x) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]);
}

std::function<double(const Point&)> level_of(const Expression& expression) {
  return [expression](const Point& x) { return expression(x); };
}

double distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

class SurfaceBuilder {
 public:
  /// All ranks must call it, and what is public here.
  SurfaceBuilder(const Scene& scene, const PlacedPoints& points, std::size_t k)
      : points_(points),
        frame_(points.frame()),
        boundary_(scene.boundaries[k]),
        key_(fmt::format("boundary.{}.surface", k)),
        surface_(level_of(*boundary_.surface), dimension(frame_.space), frame_.spacing),
        at_surface_(std::make_shared<const PointsAtSurface>(
            frame_, surface_, [&](const auto& visit) { check_lattice().over("all", visit); }, points.shared())) {}

  ImageSurface build(bool quasi_static, std::vector<FaceMotion>& motions) {
    check([&] { points_.over("all", [&](const PlacedPoints::OnePoint& point) { check_in_front(point.x); }); });
    if (at_surface_->none())
      refuse("found a surface that no point touches", "an expression that is zero on a side of the body and negative inside");
    check([&] {
      for (const PlacedPoints::OnePoint& point : at_surface_->mine()) check_thickness(point.x);
    });
    ImageSurface surface{level_of(*boundary_.surface), {}, [at_surface = at_surface_](const Point& foot, std::int64_t otherwise) {
                           return at_surface->nearest(foot, otherwise);
                         }};
    for (std::size_t c = 0; c < boundary_.components.size(); ++c) {
      surface.motion[c] = static_cast<int>(motions.size());
      motions.push_back({boundary_.velocity, function_of(*boundary_.components[c], boundary_.ramp, quasi_static)});
    }
    return surface;
  }

  /// Whether most points at the surface lie as far in front of another one, by its distances.
  template <class Distance>
  void refuse_same(const std::string& other, Distance&& depth) const {
    const auto same = std::ranges::count_if(at_surface_->mine(), [&](const PlacedPoints::OnePoint& point) {
      return std::abs(depth(point.x) - surface_.estimate(point.x)) < 1e-3 * frame_.spacing;
    });
    std::array<std::int64_t, 2> counts{same, std::ssize(at_surface_->mine())};
    if (points_.shared()) communicator().sum(counts);
    if (2 * counts[0] > counts[1]) refuse(fmt::format("found a surface that {} has too", other), "one of the two");
  }
  const LevelSurface& surface() const noexcept { return surface_; }
  const std::string& key() const noexcept { return key_; }

 private:
  [[noreturn]] void refuse(const std::string& found, const std::string& allowed) const {
    throw InputError(boundary_.face_position, key_, fmt::format("{}; allowed: {}", found, allowed));
  }

  /// Says on all ranks what is wrong first, in the order of the input.
  template <class Check>
  static void check(Check&& of_rank) {
    agreed([&] {
      of_rank();
      return true;
    });
  }

  /// On a lattice there is no place for the images.
  const PlacedPoints& check_lattice() const {
    if (points_.lattice())
      refuse(
          "found it on a lattice, which has no places for the mirror images of its points",
          "body.lattice.inside with family.partial_volume = true, body.lattice.jitter, [body.points], or a face across an axis");
    return points_;
  }

  void check_in_front(const Point& x) const {
    constexpr double least = 0.05;  // spacings: a point and its image are two ends of a bond
    const double depth = surface_.estimate(x);
    const bool on_surface = std::abs(depth) <= touching(frame_.spacing);
    if (depth < least * frame_.spacing && !on_surface)
      refuse(depth < 0 ? fmt::format("found a surface in front of the point at {}", place(x))
                       : fmt::format("found a surface {:.2g} spacings from the point at {}", depth / frame_.spacing, place(x)),
             fmt::format("an expression that is negative at all points, and zero on them or {:.3g} or more in front of them",
                         least * frame_.spacing));
    if (depth < halo(frame_.horizon) && !surface_.foot(x))
      refuse(fmt::format("found no place on the surface that is nearest to the point at {}", place(x)),
             "expressions whose gradient is smooth within two horizons of the surface");
  }

  /// Up to two horizons below the surface it must be nearest, or there would be places behind it without images.
  void check_thickness(const Point& x) const {
    const double reach = halo(frame_.horizon);
    const std::optional<Foot> foot = surface_.foot(x);
    if (!foot || foot->depth <= touching(frame_.spacing)) return;
    Point below{};
    for (std::size_t c = 0; c < 3; ++c) below[c] = foot->at[c] + (x[c] - foot->at[c]) * reach / foot->depth;
    const std::optional<Foot> back = surface_.foot(below);
    if (back && distance(back->at, foot->at) < 0.1 * frame_.spacing) return;
    refuse(fmt::format("found a surface that another part of itself comes near, or that is bent more than the horizon allows: at "
                       "{} the body is to reach two "
                       "horizons, {:.3g}, straight below it",
                       place(foot->at), reach),
           "a smaller horizon, or a [[boundary]] for each of two sides");
  }

  const PlacedPoints& points_;
  const BodyFrame& frame_;
  const BoundaryDescription& boundary_;
  std::string key_;
  LevelSurface surface_;
  std::shared_ptr<const PointsAtSurface> at_surface_;
};

}  // namespace

void keep_off_surfaces(const Scene& scene, double spacing, std::vector<Point>& positions) {
  constexpr double least = 0.25;  // spacings
  for (const BoundaryDescription& boundary : scene.boundaries) {
    if (!boundary.surface) continue;
    const LevelSurface surface(level_of(*boundary.surface), scene.body.dimension, spacing);
    for (Point& x : positions) {
      const double guess = surface.estimate(x);
      if (guess > spacing || guess < -spacing) continue;
      const std::optional<Foot> foot = surface.foot(x);
      if (!foot || foot->depth >= least * spacing) continue;
      // Straight below the foot; from the foot itself, or from behind, along the gradient.
      Point inward{};
      for (std::size_t c = 0; c < static_cast<std::size_t>(scene.body.dimension); ++c) {
        Point a = foot->at, b = foot->at;
        a[c] -= 1e-3 * spacing;
        b[c] += 1e-3 * spacing;
        inward[c] = surface.level(a) - surface.level(b);
      }
      const double length = std::hypot(inward[0], inward[1], inward[2]);
      for (std::size_t c = 0; c < 3; ++c) x[c] = foot->at[c] + least * spacing * inward[c] / length;
    }
  }
}

void add_surfaces(const Scene& scene, const PlacedPoints& points, bool quasi_static, ScenePlanes& planes) {
  std::vector<SurfaceBuilder> built;
  built.reserve(scene.boundaries.size());
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    if (!scene.boundaries[k].surface) continue;
    const SurfaceBuilder& surface = built.emplace_back(scene, points, k);
    planes.surfaces.push_back(built.back().build(quasi_static, planes.motions));
    for (std::size_t j = 0; j + 1 < built.size(); ++j)
      surface.refuse_same(built[j].key(), [&](const Point& x) { return built[j].surface().estimate(x); });
    for (std::size_t j = 0; j < planes.planes.size(); ++j)
      if (planes.planes[j].period == 0)
        surface.refuse_same(planes.origins[j].key, [&](const Point& x) { return depth(planes.planes[j], x); });
  }
}

}  // namespace perikit
