#include "setup/surfaces/surface_areas.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "body/partition/near_ranks.hpp"
#include "families/families.hpp"
#include "setup/surfaces/face_shares.hpp"
#include "setup/surfaces/first_moments.hpp"
#include "setup/surfaces/free_surface.hpp"
#include "setup/surfaces/pair_areas.hpp"

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

/// By internal index, images among them.
std::vector<Point> all_areas(const TermParts& parts) {
  const Body& body = parts.families->body();
  std::vector<Point> areas(body.stride(), Point{});
  const bool pairs = parts.formulation.pairs != nullptr;
  const Field of_pairs = pairs ? pair_areas(parts, -1) : Field();
  for (int axis = 0; axis < body.dimension(); ++axis) {
    const Field of_axis = pairs ? Field() : face_areas(parts, axis, UnitStress::all_around);
    const double* const area = pairs ? of_pairs.component(axis) : of_axis.data();
    for (const std::int32_t p : body.internal()) areas[static_cast<std::size_t>(p)][static_cast<std::size_t>(axis)] = area[p];
  }
  return areas;
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
  const std::vector<Point> areas = all_areas(parts);
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
  const bool whole = counted(std::ssize(surface)).all == counted(chosen).all;
  SurfaceAreas found;
  const auto add = [&](std::int32_t p, double share) {
    found.points.push_back(p);
    found.area.emplace_back();
    for (std::size_t a = 0; a < 3; ++a) found.area.back()[a] = share * areas[static_cast<std::size_t>(p)][a];
  };
  if (whole && parts.formulation.pairs) {
    // Inside of a cloud a uniform stress of a pair law may leave forces, too: all together they sum to zero.
    for (const std::int32_t p : body.complete())
      if (areas[static_cast<std::size_t>(p)] != Point{}) add(p, 1);
  } else {
    for (const auto& [p, share] : points_below(body, surface, felt, images, [](std::int32_t) { return true; })) add(p, share);
  }
  if (body.lattice()) add_samples(body, in_set, found);
  if (body.lattice() && !images && !whole) exact_moments(body, found);
  if (!body.lattice() && !images && whole) add_cells(body, found);
  return found;
}

}  // namespace perikit
