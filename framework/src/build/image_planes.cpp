#include "build/image_planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "build/conditions.hpp"

namespace perikit {

namespace {

/// A side across an axis, as its points and the scene place it.
struct Side {
  int axis = 0;
  double outward = 1, at = 0;
  double depth(const Point& x) const noexcept { return outward * (at - x[static_cast<std::size_t>(axis)]); }
};

/// Cells of one spacing, beside the axis.
using Cell = std::array<std::int64_t, 2>;

class PlaneBuilder {
 public:
  PlaneBuilder(const Scene& scene, const Body& body, bool quasi_static) : scene_(scene), body_(body), quasi_static_(quasi_static) {}

  ScenePlanes build() {
    for (std::size_t k = 0; k < scene_.boundaries.size(); ++k)
      if (!scene_.boundaries[k].face.empty()) add_face(k);
    for (std::size_t k = 0; k < scene_.symmetries.size(); ++k) add_symmetry(k);
    for (std::size_t k = 0; k < scene_.periodics.size(); ++k) add_periodic(k);
    return std::move(found_);
  }

 private:
  Cell beside(const Side& side, const Point& x) const {
    Cell cell{};
    for (std::size_t a = 0, k = 0; a < 3; ++a) {
      if (a == static_cast<std::size_t>(side.axis)) continue;
      const double lower = body_.lattice() ? body_.lattice()->lower[a] : 0.0;   // lattice points lie in the middle of cells
      cell[k++] = static_cast<std::int64_t>(std::floor((x[a] - lower) / body_.spacing()));
    }
    return cell;
  }
  Point position(std::int32_t p) const { return body_.position(static_cast<std::size_t>(p)); }

  /// Where the side of these points lies: half a spacing beyond a lattice point; cells of points that were moved at random keep theirs.
  double end_of(const std::vector<std::int32_t>& points, int axis, double outward, const SourcePosition& position, const std::string& key) const {
    const auto a = static_cast<std::size_t>(axis);
    double extreme = -std::numeric_limits<double>::infinity();
    for (const std::int32_t p : points) extreme = std::max(extreme, outward * this->position(p)[a]);
    extreme *= outward;
    if (body_.lattice()) return extreme + 0.5 * outward * body_.spacing();
    if (!scene_.body.lattice) {
      throw InputError(position, key,
                       fmt::format("found nothing for points from a file, whose outermost lies at {:.6g}; allowed: the coordinate of the side", extreme));
    }
    const double lower = scene_.body.lattice->lower[a], cells = std::floor((extreme - lower) / body_.spacing());
    return lower + (cells + (outward > 0 ? 1 : 0)) * body_.spacing();
  }

  /// A given coordinate, which on lattices lies between two points.
  double given(double at, int axis, const SourcePosition& position, const std::string& key) const {
    if (!body_.lattice()) return at;
    const double cells = (at - body_.lattice()->lower[static_cast<std::size_t>(axis)]) / body_.spacing();
    if (std::abs(cells - std::round(cells)) < 1e-6) return at;
    throw InputError(position, key,
                     fmt::format("found {:.6g}, which does not lie half-way between points of the lattice; allowed: its lower corner and "
                                 "multiples of the spacing from there, {:.6g} for one",
                                 at, at + (std::round(cells) - cells) * body_.spacing()));
  }

  /// By input number: the point at the side below which each point lies; -1: below none of `points`. whole: the side is that of the body, and
  /// no point is left out.
  std::vector<std::int32_t> surface(const Side& side, const std::vector<std::int32_t>& points, bool whole) const {
    const double h = body_.spacing(), layer = (body_.lattice() ? 0.75 : 1.2) * h;
    std::map<Cell, std::vector<std::int32_t>> cells;   // of points at the side
    for (const std::int32_t p : body_.owned())
      if (const double d = side.depth(position(p)); d >= 0 && d < layer) cells[beside(side, position(p))].push_back(p);
    std::vector<bool> chosen(body_.stride(), false);
    for (const std::int32_t p : points) chosen[static_cast<std::size_t>(p)] = true;
    std::vector<std::int32_t> surface(body_.points(), -1);
    if (cells.empty()) return surface;
    const double reach = halo(body_);
    for (const std::int32_t p : body_.owned()) {
      const double d = side.depth(position(p));
      if (d < 0 || d > reach) continue;
      const std::int32_t nearest = nearest_of(cells, side, position(p));
      const auto input = [&](std::int32_t q) { return body_.input_of(static_cast<std::size_t>(q)); };
      if (nearest >= 0 && (whole || chosen[static_cast<std::size_t>(nearest)])) surface[static_cast<std::size_t>(input(p))] = input(nearest);
      else if (nearest < 0 && whole) surface[static_cast<std::size_t>(input(p))] = input(p);   // behind a notch
    }
    return surface;
  }

  /// The nearest beside the axis: on lattices the one of the same column, on clouds one at most two cells away.
  std::int32_t nearest_of(const std::map<Cell, std::vector<std::int32_t>>& cells, const Side& side, const Point& x) const {
    const Cell centre = beside(side, x);
    const std::int64_t ring = body_.lattice() ? 0 : 2;
    std::int32_t nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (std::int64_t i = -ring; i <= ring; ++i)
      for (std::int64_t j = -ring; j <= ring; ++j) {
        const auto found = cells.find({centre[0] + i, centre[1] + j});
        if (found == cells.end()) continue;
        for (const std::int32_t q : found->second) {
          const Point y = position(q);
          double square = 0;
          for (std::size_t a = 0; a < 3; ++a)
            if (a != static_cast<std::size_t>(side.axis)) square += (x[a] - y[a]) * (x[a] - y[a]);
          if (square < least) least = square, nearest = q;
        }
      }
    return nearest;
  }

  void refuse_points_beyond(const Side& side, const SourcePosition& where, const std::string& key) const {
    for (const std::int32_t p : body_.owned()) {
      const Point x = position(p);
      if (side.depth(x) < 0)
        throw InputError(where, key, fmt::format("found a plane through the body, at {:.6g}: a point at ({:.6g}, {:.6g}, {:.6g}) lies behind it; "
                                                 "allowed: a plane with all points on one side", side.at, x[0], x[1], x[2]));
    }
  }

  /// may_exist: several [[boundary]] may prescribe components of one face, and sets may share a plane.
  ImagePlane& plane_at(const Side& side, const std::string& set, const std::string& key, const SourcePosition& where, bool may_exist) {
    for (std::size_t k = 0; k < found_.planes.size(); ++k) {
      ImagePlane& plane = found_.planes[k];
      if (plane.axis != side.axis || std::abs(plane.at - side.at) > 1e-6 * body_.spacing() || plane.outward != side.outward) continue;
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
    const std::vector<std::int32_t>& points = body_.set(boundary.set);
    Side side{boundary.face[1] - 'x', boundary.face[0] == '+' ? 1.0 : -1.0, 0};
    side.at = boundary.at ? given(*boundary.at, side.axis, boundary.face_position, fmt::format("boundary.{}.at", k))
                          : end_of(points, side.axis, side.outward, boundary.face_position, fmt::format("boundary.{}.at", k));
    ImagePlane& plane = plane_at(side, boundary.set, key, boundary.face_position, true);
    const bool whole = boundary.set == "all";
    if (whole) refuse_points_beyond(side, boundary.face_position, key);
    if (plane.surface.empty()) {
      plane.surface = surface(side, points, whole);
      if (std::ranges::all_of(plane.surface, [](std::int32_t p) { return p < 0; }))
        throw InputError(boundary.face_position, key, fmt::format("found \"{}\" at {:.6g}, which no point of the set \"{}\" touches; allowed: a face of the set", boundary.face, side.at, boundary.set));
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

  void add_symmetry(std::size_t k) {
    const SymmetryDescription& symmetry = scene_.symmetries[k];
    const std::string key = fmt::format("symmetry.{}.at", k);
    Side side{symmetry.axis, -1, 0};
    const auto a = static_cast<std::size_t>(symmetry.axis);
    if (symmetry.at) {
      side.at = given(*symmetry.at, symmetry.axis, symmetry.position, key);
      side.outward = position(body_.owned().front())[a] > side.at ? -1.0 : 1.0;
    } else {
      side.at = end_of(body_.owned(), symmetry.axis, side.outward, symmetry.position, key);
    }
    refuse_points_beyond(side, symmetry.position, key);
    ImagePlane& plane = plane_at(side, "all", fmt::format("symmetry.{}.axis", k), symmetry.position, false);
    plane.odd[a] = true;
    plane.surface = surface(side, body_.owned(), true);
    if (std::ranges::all_of(plane.surface, [](std::int32_t p) { return p < 0; }))
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
                       : end_of(body_.owned(), periodic.axis, sides[s].outward, periodic.position, key);
      refuse_points_beyond(sides[s], periodic.position, key);
    }
    for (const Side& side : sides) {
      ImagePlane& plane = plane_at(side, "all", path + ".axis", periodic.position, false);
      plane.period = sides[1].at - sides[0].at;
      plane.surface.assign(body_.points(), 0);
    }
  }

  const Scene& scene_;
  const Body& body_;
  bool quasi_static_;
  ScenePlanes found_;
};

}  // namespace

ScenePlanes build_planes(const Scene& scene, const Body& body, bool quasi_static) {
  return PlaneBuilder(scene, body, quasi_static).build();
}

}  // namespace perikit
