#include "setup/surfaces/image_planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "body/images/image_list.hpp"
#include "perikit/core/rank_values.hpp"
#include "setup/body/sets.hpp"
#include "setup/body/several_ranks.hpp"
#include "setup/conditions.hpp"
#include "setup/surfaces/held_surfaces.hpp"
#include "setup/surfaces/outer_layer.hpp"

namespace perikit {

namespace {

/// A side across an axis, as its points and the scene place it.
struct Side {
  int axis = 0;
  double outward = 1, at = 0;
  double depth(const Point& x) const noexcept { return outward * (at - x[static_cast<std::size_t>(axis)]); }
};

/// How far from a side its outermost points lie at most, in spacings.
double layer_at(const PlacedPoints& points) {
  return (points.lattice() ? 0.75 : 1.2) * points.frame().spacing;
}

/// The points of a cloud at a side: which of them lies nearest to the foot of a point.
class PointsAtSide {
 public:
  struct Outermost {
    Point x;
    std::int64_t number, chosen;
  };
  /// All ranks must call it.
  PointsAtSide(const PlacedPoints& points, const Side& side, const std::string& set) : side_(side), spacing_(points.frame().spacing) {
    const auto over = [&](const std::string& name, auto&& visit) {
      points.over(name, [&](const PlacedPoints::OnePoint& point) {
        if (const double d = side_.depth(point.x); d >= -touching(spacing_) && d < layer_at(points)) visit(point.x, point.number);
      });
    };
    std::vector<Outermost> found;
    over("all", [&](const Point& x, std::int64_t number) { found.push_back({x, number, set == "all"}); });
    if (set != "all")
      over(set, [&](const Point&, std::int64_t number) { std::ranges::lower_bound(found, number, {}, &Outermost::number)->chosen = 1; });
    if (points.shared()) found = told_to_all(gathered<Outermost>(found));
    for (const Outermost& point : found) cells_[beside(point.x)].push_back(point);
  }
  /// No farther than two cells away; null: there is none.
  const Outermost* nearest(const Point& x) const {
    const Cell centre = beside(x);
    constexpr std::int64_t ring = 2;
    const Outermost* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (std::int64_t i = -ring; i <= ring; ++i)
      for (std::int64_t j = -ring; j <= ring; ++j) {
        const auto found = cells_.find({centre[0] + i, centre[1] + j});
        if (found == cells_.end()) continue;
        for (const Outermost& point : found->second) {
          const double depth = side_.depth(point.x);  // of two points below each other the outer one is meant
          double square = depth * depth;
          for (std::size_t a = 0; a < 3; ++a)
            if (a != static_cast<std::size_t>(side_.axis)) square += (x[a] - point.x[a]) * (x[a] - point.x[a]);
          if (square < least) least = square, nearest = &point;
        }
      }
    return nearest;
  }

 private:
  /// Cells of one spacing, beside the axis.
  using Cell = std::array<std::int64_t, 2>;
  Cell beside(const Point& x) const {
    Cell cell{};
    for (std::size_t a = 0, k = 0; a < 3; ++a)
      if (a != static_cast<std::size_t>(side_.axis)) cell[k++] = static_cast<std::int64_t>(std::floor(x[a] / spacing_));
    return cell;
  }

  Side side_;
  double spacing_;
  std::map<Cell, std::vector<Outermost>> cells_;
};

class PlaneBuilder {
 public:
  PlaneBuilder(const Scene& scene, const std::shared_ptr<const PlacedPoints>& points, bool quasi_static)
      : scene_(scene), points_(points), lattice_(points->lattice()), spacing_(points->frame().spacing), quasi_static_(quasi_static) {}

  ScenePlanes build() {
    for (std::size_t k = 0; k < scene_.boundaries.size(); ++k)
      if (!scene_.boundaries[k].face.empty()) add_face(k);
    for (std::size_t k = 0; k < scene_.symmetries.size(); ++k) add_symmetry(k);
    for (std::size_t k = 0; k < scene_.periodics.size(); ++k) add_periodic(k);
    for (std::size_t k = 0; k < scene_.boundaries.size() && sets_may_hold_sides(scene_); ++k)
      if (!scene_.boundaries[k].holds_side()) add_side_of_set(k);
    return std::move(found_);
  }

 private:
  /// The coordinate of the outermost of these points, on all ranks.
  double outermost(const std::string& set, int axis, double outward) const {
    double extreme = -std::numeric_limits<double>::infinity();
    points_->over(set, [&](const PlacedPoints::OnePoint& point) {
      extreme = std::max(extreme, outward * point.x[static_cast<std::size_t>(axis)]);
    });
    return outward * communicator().largest(extreme);
  }

  /// Where the side of these points lies: half a spacing beyond a lattice point; cells of points that were moved at random keep theirs.
  double end_of(const std::string& set, int axis, double outward, const SourcePosition& position, const std::string& key) {
    const double extreme = outermost(set, axis, outward);
    if (lattice_) return extreme + 0.5 * outward * spacing_;
    if (!scene_.body.lattice) return end_of_file(set, axis, outward, position, key);
    const double lower = scene_.body.lattice->lower[static_cast<std::size_t>(axis)], cells = std::floor((extreme - lower) / spacing_);
    return lower + (cells + (outward > 0 ? 1 : 0)) * spacing_;
  }

  OuterLayer layer_on(const Side& side, const std::string& set) const {
    return outer_layer(spacing_, points_->shared(), [&](const auto& visit) {
      points_->over(set, [&](const PlacedPoints::OnePoint& point) { visit(side.depth(point.x), point.volume); });
    });
  }

  /// Where the side of points from a file lies: that of the box of their cells, or where the volumes of the outermost layer say. Points on the
  /// side have half of the cells that the next layer has; others lie in the middle of theirs.
  double end_of_file(const std::string& set, int axis, double outward, const SourcePosition& position, const std::string& key) {
    const double extreme = outermost(set, axis, outward);
    const auto a = static_cast<std::size_t>(axis);
    const std::optional<std::array<double, 3>>& box = outward > 0 ? scene_.body.points_upper : scene_.body.points_lower;
    if (box && std::abs((*box)[a] - extreme) < 1.2 * spacing_) return found_at((*box)[a], extreme, axis, outward, "that of the box of the points' cells");
    const OuterLayer layer = layer_on({axis, outward, extreme}, set);
    if (!layer.clear())
      throw InputError(position, key,
                       fmt::format("found nothing for points from a file, whose outermost lies at {:.6g} and is no part of a layer; allowed: the coordinate of the side", extreme));
    if (layer.half_cells()) return found_at(extreme, extreme, axis, outward, "by the volumes of its points, which are those of half cells");
    const double cell = std::pow(layer.outer / points_->frame().section, 1.0 / scene_.body.dimension);
    return found_at(extreme + 0.5 * outward * cell, extreme, axis, outward, "by the volumes of its points, half a cell beyond them");
  }
  double found_at(double at, double extreme, int axis, double outward, const std::string& why) {
    const bool on_side = std::abs(at - extreme) <= touching(spacing_);
    found_.notes.push_back(fmt::format("{}{} at {:.6g}, {}{}", outward > 0 ? '+' : '-', "xyz"[axis], at, why, on_side ? "; its points lie on it" : ""));
    return at;
  }

  /// A given coordinate, which on lattices lies between two points.
  double given(double at, int axis, const SourcePosition& position, const std::string& key) const {
    if (!lattice_) return at;
    const double cells = (at - lattice_->lower[static_cast<std::size_t>(axis)]) / spacing_;
    if (std::abs(cells - std::round(cells)) < 1e-6) return at;
    double plane = at + (std::round(cells) - cells) * spacing_;
    if (std::abs(plane) < 1e-9 * spacing_) plane = 0;   // but for rounding
    throw InputError(position, key,
                     fmt::format("found {:.6g}, which does not lie half-way between points of the lattice; allowed: its lower corner and "
                                 "multiples of the spacing from there, {:.6g} for one",
                                 at, plane));
  }

  /// Whether one of the points of a set, on whatever rank, lies at a side.
  bool touched(const Side& side, const std::string& set) const {
    double found = 0;
    points_->over(set, [&](const PlacedPoints::OnePoint& point) {
      if (const double d = side.depth(point.x); d >= -touching(spacing_) && d < layer_at(*points_)) found = 1;
    });
    return communicator().largest(found) > 0;
  }

  /// The point at the side below which a point lies: on lattices that of the same column, on clouds the nearest. Where the side is that of
  /// the whole body no point is left out.
  std::function<std::int64_t(const Point&, std::int64_t)> surface(const Side& side, const std::string& set) const {
    const bool whole = set == "all";
    const auto far = [side, least = -touching(spacing_), reach = halo(points_->frame().horizon)](const Point& x) {
      const double d = side.depth(x);
      return d < least || d > reach;
    };
    if (!lattice_)
      return [at_side = std::make_shared<const PointsAtSide>(*points_, side, set), whole, far](const Point& x, std::int64_t number) {
        const PointsAtSide::Outermost* const nearest = far(x) ? nullptr : at_side->nearest(x);
        if (nearest && nearest->chosen) return nearest->number;
        return whole && !nearest && !far(x) ? number : std::int64_t{-1};   // behind a notch
      };
    std::size_t axis = 0;
    while (lattice_->axis[axis] != side.axis) ++axis;
    Point inner{};
    inner[static_cast<std::size_t>(side.axis)] = side.at - 0.5 * side.outward * spacing_;
    return [points = points_, lattice = *lattice_, set, whole, far, axis, last = lattice_->around(inner)[axis]](const Point& x, std::int64_t number) {
      if (far(x)) return std::int64_t{-1};
      std::array<std::int64_t, 3> cell = lattice.around(x);
      cell[axis] = last;
      const std::int64_t found = points->at(cell, set);
      return found < 0 && whole ? number : found;   // behind a notch
    };
  }

  void refuse_points_beyond(const Side& side, const SourcePosition& where, const std::string& key) const {
    struct Beyond {
      double depth;
      Point x;
      std::int64_t number;
    };
    std::vector<Beyond> mine;   // the one farthest behind, the first of several
    points_->over("all", [&](const PlacedPoints::OnePoint& point) {
      const double d = side.depth(point.x);
      if (d < -touching(spacing_) && (mine.empty() || d < mine.front().depth)) mine.assign(1, {d, point.x, point.number});
    });
    const std::vector<Beyond> all = told_to_all(gathered<Beyond>(mine));
    if (all.empty()) return;
    const Beyond& first = *std::ranges::min_element(all, {}, [](const Beyond& beyond) { return std::pair(beyond.depth, beyond.number); });
    throw InputError(where, key, fmt::format("found a plane through the body, at {:.6g}: a point at ({:.6g}, {:.6g}, {:.6g}) lies behind it; "
                                             "allowed: a plane with all points on one side", side.at, first.x[0], first.x[1], first.x[2]));
  }

  /// A point and its image are two ends of a bond, and a point on a plane is its own image: nothing may lie between.
  void refuse_points_close(const Side& side, const std::string& set, const SourcePosition& where, const std::string& key) const {
    if (lattice_) return;
    constexpr double least = 0.05;  // spacings
    double nearest = std::numeric_limits<double>::infinity();
    points_->over(set, [&](const PlacedPoints::OnePoint& point) {
      if (const double d = side.depth(point.x); d > touching(spacing_)) nearest = std::min(nearest, d);
    });
    nearest = -communicator().largest(-nearest);
    if (nearest >= least * spacing_) {
      refuse_whole_cells(side, set, where, key);
      return;
    }
    throw InputError(where, key, fmt::format("found a side at {:.6g}, with a point {:.2g} spacings from it; allowed: points on the side, or {:.3g} and more in front of it",
                                             side.at, nearest / spacing_, least * spacing_));
  }

  /// A point on a side stands for the part of its cell that lies inside.
  void refuse_whole_cells(const Side& side, const std::string& set, const SourcePosition& where, const std::string& key) const {
    const OuterLayer layer = layer_on(side, set);
    if (layer.outer == 0 || layer.inner == 0 || layer.half_cells()) return;
    throw InputError(where, key, fmt::format("found points on the side, at {:.6g}, that have {:.3g} times the volume of those behind them; allowed: the volumes of those parts of "
                                             "their cells that lie inside, about a half, or a side half a cell beyond the points",
                                             side.at, layer.outer / layer.inner));
  }

  /// Whether one of all points lies on a side.
  bool touches(const Side& side) const {
    double found = 0;
    points_->over("all", [&](const PlacedPoints::OnePoint& point) {
      if (std::abs(side.depth(point.x)) <= touching(spacing_)) found = 1;
    });
    return communicator().largest(found) > 0;
  }

  /// may_exist: several [[boundary]] may prescribe components of one face, and sets may share a plane.
  ImagePlane& plane_at(const Side& side, const std::string& set, const std::string& key, const SourcePosition& where, bool may_exist) {
    for (std::size_t k = 0; k < found_.planes.size(); ++k) {
      ImagePlane& plane = found_.planes[k];
      if (plane.axis != side.axis || std::abs(plane.at - side.at) > 1e-6 * spacing_ || plane.outward != side.outward) continue;
      if (may_exist && found_.origins[k].set == set) return plane;
      if (plane.period == 0 && may_exist) continue;   // of another set
      throw InputError(where, key, fmt::format("found a side, at {:.6g}, that {} has too; allowed: one of the two", side.at, found_.origins[k].key));
    }
    found_.origins.push_back({key, set, where});
    ImagePlane& plane = found_.planes.emplace_back();
    plane.axis = side.axis;
    plane.at = side.at;
    plane.outward = side.outward;
    return plane;
  }

  void add_face(std::size_t k) {
    const BoundaryDescription& boundary = scene_.boundaries[k];
    const std::string key = fmt::format("boundary.{}.face", k);
    Side side{boundary.face[1] - 'x', boundary.face[0] == '+' ? 1.0 : -1.0, 0};
    if (std::isinf(outermost(boundary.set, side.axis, side.outward)))
      refuse_empty_set(*std::ranges::find(scene_.sets, boundary.set, &SetDescription::name));
    side.at = boundary.at ? given(*boundary.at, side.axis, boundary.face_position, fmt::format("boundary.{}.at", k))
                          : end_of(boundary.set, side.axis, side.outward, boundary.face_position, fmt::format("boundary.{}.at", k));
    ImagePlane& plane = plane_at(side, boundary.set, key, boundary.face_position, true);
    const bool whole = boundary.set == "all";
    if (whole) refuse_points_beyond(side, boundary.face_position, key);
    refuse_points_close(side, boundary.set, boundary.face_position, key);
    if (!plane.surface) {
      if (!touched(side, boundary.set))
        throw InputError(boundary.face_position, key, fmt::format("found \"{}\" at {:.6g}, which no point of the set \"{}\" touches; allowed: a face of the set", boundary.face, side.at, boundary.set));
      plane.surface = surface(side, boundary.set);
    }
    for (std::size_t c = 0; c < boundary.components.size(); ++c) {
      if (!boundary.components[c]) continue;
      if (plane.odd[c])
        throw InputError(boundary.face_position, key, fmt::format("found \"{}\", whose component {} {} prescribes too; allowed: each once", boundary.face, "xyz"[c], found_.origins[static_cast<std::size_t>(&plane - found_.planes.data())].key));
      plane.odd[c] = true;
      plane.motion[c] = static_cast<int>(found_.motions.size());
      found_.motions.push_back({boundary.velocity, function_of(*boundary.components[c], boundary.ramp, quasi_static_)});
    }
  }

  /// The side of the body that a set consists of: all points that lie on it, and no others.
  std::optional<Side> side_of(const std::string& set) const {
    for (int axis = 0; axis < scene_.body.dimension; ++axis)
      for (const double outward : {-1.0, 1.0}) {
        Side side{axis, outward, outermost("all", axis, outward)};
        if (std::abs(outermost(set, axis, -outward) - side.at) > touching(spacing_)) continue;
        std::array<ExactSum, 2> sums;  // points on the side, and those of the set
        const auto add = [&](const std::string& name, std::size_t to) {
          points_->over(name, [&](const PlacedPoints::OnePoint& point) {
            if (side.depth(point.x) <= touching(spacing_)) sums[to].add(1);
          });
        };
        add("all", 0);
        add(set, 1);
        const auto count = [&](std::size_t k) { return points_->shared() ? total_over_ranks(sums[k]) : sums[k].value(); };
        if (count(0) == count(1) && layer_on(side, "all").half_cells()) return side;
      }
    return std::nullopt;
  }

  /// Points on a side that a set holds hold the side: it has images behind it as a face has, unless a face or a plane has them already.
  void add_side_of_set(std::size_t k) {
    const BoundaryDescription& boundary = scene_.boundaries[k];
    const std::optional<Side> side = std::isinf(outermost(boundary.set, 0, 1)) ? std::nullopt : side_of(boundary.set);
    if (!side) return;
    const std::string key = fmt::format("boundary.{}.set", k);
    const auto same = [&](const ImagePlane& plane) { return plane.axis == side->axis && std::abs(plane.at - side->at) <= touching(spacing_); };
    if (const auto there = std::ranges::find_if(found_.planes, same);
        there != found_.planes.end() && !found_.origins[static_cast<std::size_t>(there - found_.planes.begin())].key.ends_with(".set"))
      return;
    ImagePlane& plane = plane_at(*side, "all", key, boundary.position, true);
    if (!plane.surface) {
      plane.surface = surface(*side, "all");
      found_.notes.push_back(fmt::format("{}{} at {:.6g}: the set \"{}\" consists of the points on it, and holds it", side->outward > 0 ? '+' : '-', "xyz"[side->axis], side->at, boundary.set));
    }
    for (std::size_t c = 0; c < boundary.components.size(); ++c) {
      if (!boundary.components[c] || plane.odd[c]) continue;
      plane.odd[c] = true;
      plane.motion[c] = static_cast<int>(found_.motions.size());
      found_.motions.push_back({boundary.velocity, function_of(*boundary.components[c], boundary.ramp, quasi_static_), true});
    }
  }

  void add_symmetry(std::size_t k) {
    const SymmetryDescription& symmetry = scene_.symmetries[k];
    const std::string key = fmt::format("symmetry.{}.at", k);
    Side side{symmetry.axis, -1, 0};
    const auto a = static_cast<std::size_t>(symmetry.axis);
    if (symmetry.at) {
      side.at = given(*symmetry.at, symmetry.axis, symmetry.position, key);
      side.outward = outermost("all", symmetry.axis, 1) > side.at ? -1.0 : 1.0;
    } else {
      side.at = end_of("all", symmetry.axis, side.outward, symmetry.position, key);
    }
    refuse_points_beyond(side, symmetry.position, key);
    refuse_points_close(side, "all", symmetry.position, key);
    ImagePlane& plane = plane_at(side, "all", fmt::format("symmetry.{}.axis", k), symmetry.position, false);
    plane.odd[a] = true;
    plane.surface = surface(side, "all");
    if (!touched(side, "all"))
      throw InputError(symmetry.position, key, fmt::format("found {:.6g}, which no point comes near; allowed: a side of the body", side.at));
  }

  void add_periodic(std::size_t k) {
    const PeriodicDescription& periodic = scene_.periodics[k];
    const std::string path = fmt::format("periodic.{}", k);
    std::array<Side, 2> sides{Side{periodic.axis, -1, 0}, Side{periodic.axis, 1, 0}};
    for (std::size_t s = 0; s < 2; ++s) {
      const std::string key = path + (s == 0 ? ".lower" : ".upper");
      const std::optional<double>& at = s == 0 ? periodic.lower : periodic.upper;
      sides[s].at = at ? given(*at, periodic.axis, periodic.position, key)
                       : end_of("all", periodic.axis, sides[s].outward, periodic.position, key);
      refuse_points_beyond(sides[s], periodic.position, key);
    }
    if (!lattice_ && touches(sides[0]) && touches(sides[1]))
      throw InputError(periodic.position, path + ".axis",
                       fmt::format("found points on both sides, at {:.6g} and {:.6g}, which are the same places; allowed: the points of one of them, with the volumes of their whole cells",
                                   sides[0].at, sides[1].at));
    for (const Side& side : sides) {
      ImagePlane& plane = plane_at(side, "all", path + ".axis", periodic.position, false);
      plane.period = sides[1].at - sides[0].at;
      plane.surface = itself;
    }
  }

  const Scene& scene_;
  std::shared_ptr<const PlacedPoints> points_;
  const Lattice* lattice_;
  double spacing_;
  bool quasi_static_;
  ScenePlanes found_;
};

}  // namespace

ScenePlanes build_planes(const Scene& scene, const std::shared_ptr<const PlacedPoints>& points, bool quasi_static) {
  ScenePlanes planes = PlaneBuilder(scene, points, quasi_static).build();
  add_surfaces(scene, *points, quasi_static, planes);
  return planes;
}

void refuse_overlap(const ScenePlanes& planes, const OverlappingImage& error) {
  // Only sides of parts of a lattice can have something beyond them.
  const auto of_part = std::ranges::find_if(planes.origins, [](const auto& origin) { return origin.set != "all"; });
  const ScenePlanes::Origin& origin = of_part == planes.origins.end() ? planes.origins.front() : *of_part;
  throw InputError(origin.position, origin.key, fmt::format("{}; allowed: a side with nothing beyond it", error.what()));
}

}  // namespace perikit
