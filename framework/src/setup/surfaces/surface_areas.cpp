#include "setup/surfaces/surface_areas.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "body/partition/near_ranks.hpp"
#include "families/families.hpp"
#include "setup/surfaces/face_shares.hpp"
#include "setup/surfaces/first_moments.hpp"
#include "setup/surfaces/free_surface.hpp"

namespace perikit {

namespace {

SurfaceAreas of_face(const LoadDescription& load, const TermParts& parts, const ImageMap* images) {
  const auto axis = static_cast<std::size_t>(load.face[1] - 'x');
  const double outward = load.face[0] == '+' ? 1 : -1;
  FaceShares shares = face_shares(load, parts, images);
  SurfaceAreas areas;
  areas.points = std::move(shares.points);
  for (const double share : shares.share) areas.area.emplace_back()[axis] = outward * share;
  for (double& weight : shares.samples.weight) weight *= outward;
  areas.samples[axis] = std::move(shares.samples);
  return areas;
}

/// Pair laws: the free faces of the cells lie half a spacing beyond their points, so that 3/2 there and -1/2 one point further in
/// give the right total and the right moment.
std::vector<Point> of_cells(const Body& body, const CellFaces& faces) {
  const Lattice& lattice = *body.lattice();
  std::vector<Point> areas(body.stride(), Point{});
  for (const std::int32_t p : body.internal()) {
    const auto i = static_cast<std::size_t>(p);
    if (body.image(i)) continue;
    for (std::size_t k = 0; k < static_cast<std::size_t>(body.dimension()); ++k) {
      const auto c = static_cast<std::size_t>(lattice.axis[k]);
      const double area = faces.area[i][c];
      if (area == 0) continue;
      std::array<int, 3> step{};
      step[k] = area > 0 ? -1 : 1;
      const auto inner =
          static_cast<std::size_t>(p + lattice.shift(step));  // there, or the two faces across this axis would cancel
      areas[i][c] += 1.5 * area;
      areas[inner][c] -= 0.5 * area;
    }
  }
  return areas;
}

/// By internal index, images among them.
std::vector<Point> all_areas(const LoadDescription& load, const TermParts& parts) {
  const Body& body = parts.families->body();
  if (!parts.formulation.pairs) {
    std::vector<Point> areas(body.stride(), Point{});
    for (int axis = 0; axis < body.dimension(); ++axis) {
      const Field of_axis = face_areas(parts, axis, UnitStress::all_around);
      for (const std::int32_t p : body.internal()) areas[static_cast<std::size_t>(p)][static_cast<std::size_t>(axis)] = of_axis.data()[p];
    }
    return areas;
  }
  if (body.lattice()) return of_cells(body, CellFaces(body));
  throw InputError(load.position, "load.pressure",
                   "found on a cloud with a pair law, which has no area vectors there; allowed: lattices, kinematics with "
                   "gradients, or a traction on a face");
}

/// To the samples of the surface the places of the points that carry it.
void add_points(const Body& body, SurfaceSamples& samples, std::size_t axis, SurfaceAreas& areas) {
  for (const std::int32_t p : areas.points) {
    samples.place.push_back(body.position(static_cast<std::size_t>(p)));
    samples.weight.push_back(0);
    samples.group.push_back(samples.end_group());
  }
  areas.samples[axis] = std::move(samples);
}

/// The free cell faces of the set, and the places of the points that carry them.
void add_samples(const Body& body, const std::vector<std::uint8_t>& in_set, SurfaceAreas& areas) {
  const double area = body.uniform_volume() / body.spacing();
  std::array<SurfaceSamples, 3> samples;
  over_free_faces(body, body.owned(), [&](std::int32_t p, std::size_t axis, int sign) {
    if (!in_set[static_cast<std::size_t>(p)]) return;
    Point middle = body.position(static_cast<std::size_t>(p));
    middle[axis] += 0.5 * sign * body.spacing();
    add_cell(body.dimension(), static_cast<int>(axis), middle, body.spacing(), sign * area, samples[axis]);
  });
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(body.dimension()); ++axis) add_points(body, samples[axis], axis, areas);
}

/// Of a part of the surface of a lattice: force and first moments of a pressure on its cell faces.
void exact_moments(const Body& body, SurfaceAreas& areas) {
  std::vector<double> share(areas.area.size());
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(body.dimension()); ++axis) {
    for (std::size_t k = 0; k < share.size(); ++k) share[k] = areas.area[k][axis];
    give_first_moments(body, areas.points, *areas.samples[axis], share);
    for (std::size_t k = 0; k < share.size(); ++k) areas.area[k][axis] = share[k];
  }
}

/// Of the whole surface of a cloud, whose faces nobody knows: by Gauss's theorem the integral of f n over it is that of grad f over the body. Cells of points have
/// two faces across each axis; where those of neighbours meet they cancel, and what is left is exact for linear pressures and their first moments.
void add_cells(const Body& body, SurfaceAreas& areas) {
  const double side = body.spacing();
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(body.dimension()); ++axis) {
    SurfaceSamples samples;
    for (const std::int32_t p : body.owned())
      for (const double sign : {-1.0, 1.0}) {
        Point x = body.position(static_cast<std::size_t>(p));
        x[axis] += 0.5 * sign * side;
        samples.place.push_back(x);
        samples.weight.push_back(sign * body.volume(static_cast<std::size_t>(p)) / side);
        samples.end_group();
      }
    add_points(body, samples, axis, areas);
  }
}

}  // namespace

SurfaceAreas surface_areas(const LoadDescription& load, const TermParts& parts, const ImageMap* images) {
  if (!load.face.empty()) return of_face(load, parts, images);
  const Body& body = parts.families->body();
  std::vector<std::uint8_t> in_set(body.stride(), 0);
  for (const std::int32_t p : body.set(load.set)) in_set[static_cast<std::size_t>(p)] = 1;
  const std::vector<Point> areas = all_areas(load, parts);
  std::vector<SurfacePoint> surface;
  for (const std::int32_t p : free_surface(body)) {
    const auto i = static_cast<std::size_t>(p);
    surface.push_back({body.position(i), in_set[i]});
  }
  const auto chosen = std::ranges::count_if(surface, [](const SurfacePoint& point) { return point.chosen != 0; });
  if (counted(chosen).all == 0 && communicator().complete()) {
    throw InputError(load.position, "load.pressure",
                     fmt::format("found on the set \"{}\", none of whose points lies at the free surface of the body; allowed: "
                                 "sets with a free surface",
                                 load.set));
  }
  const double felt = 3 * body.horizon();  // a surface is felt no deeper
  SurfaceAreas found;
  for (const auto& [p, share] : points_below(body, surface, felt, images, [](std::int32_t) { return true; })) {
    found.points.push_back(p);
    found.area.emplace_back();
    for (std::size_t a = 0; a < 3; ++a) found.area.back()[a] = share * areas[static_cast<std::size_t>(p)][a];
  }
  const bool whole = counted(std::ssize(surface)).all == counted(chosen).all;
  if (body.lattice()) add_samples(body, in_set, found);
  if (body.lattice() && !images && !whole) exact_moments(body, found);
  if (!body.lattice() && !images && whole) add_cells(body, found);
  return found;
}

}  // namespace perikit
