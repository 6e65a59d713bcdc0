#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>

#include "build/conditions.hpp"
#include "build/face_shares.hpp"
#include "build/surface_areas.hpp"
#include "families/families.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// The sum of the volumes of the points of a set; of a part of a body of those on all ranks, which must all call it.
double total_volume(const Body& body, const std::vector<std::int32_t>& points) {
  ExactSum total;
  for (const std::int32_t p : points) total.add(body.volume(static_cast<std::size_t>(p)));
  return body.part() ? total_over_ranks(total) : total.value();
}

/// Points and shares of a load without its values, on the points of the body.
Load distributed(const LoadDescription& description, const Body& body, const TermParts& parts, const ImageMap* images) {
  Load load;
  if (description.type == LoadDescription::Type::traction) {
    for (const auto& [p, share] : face_shares(description, parts, images)) {
      load.points.push_back(p);
      load.share.push_back(share);
    }
    return load;
  }
  load.points = body.set(description.set);
  const double total = description.type == LoadDescription::Type::force ? total_volume(body, load.points) : 0.0;
  for (const std::int32_t p : load.points) {
    const double volume = body.volume(static_cast<std::size_t>(p));
    load.share.push_back(description.type == LoadDescription::Type::force ? volume / total : volume);
  }
  return load;
}

/// By internal index of the whole body: where the points are in a part whose forces it must know; -1: others. Loads on images are loads on
/// their sources.
std::vector<std::int32_t> own_places(const Body& part) {
  std::vector<std::int32_t> own(part.stride_of_all_ranks(), -1);
  for (const std::int32_t p : part.complete()) own[static_cast<std::size_t>(part.places().place[static_cast<std::size_t>(p)])] = p;
  return own;
}

/// What of a load on the whole body falls on the points of a part: points, and what each has of it.
template <class Share>
void keep_owned(const std::vector<std::int32_t>& own, std::vector<std::int32_t>& points, std::vector<Share>& shares) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::int32_t place = own[static_cast<std::size_t>(points[k])];
    if (place < 0) continue;
    points[kept] = place;
    shares[kept++] = shares[k];
  }
  points.resize(kept);
  shares.resize(kept);
}

void refuse_pressure(const Scene& scene, const LoadDescription& load, const TermParts& parts) {
  const auto refuse = [&](const std::string& text) { throw InputError(load.position, "load.pressure", text); };
  if (!load.follower) return;
  if (parts.formulation.pairs)
    refuse("found with follower = true and a pair law, which has no deformation gradients; allowed: kinematics with gradients");
  if (std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.holds_side(); }))
    refuse(
        "found with follower = true and a [[boundary]] with a face or surface, whose images have no deformation gradient of their own; "
        "allowed: a boundary that holds a set");
}

/// A pressure that does not follow: a load along each axis.
std::vector<Load> loads_along_axes(const SpaceTimeFunction& value, const SurfaceAreas& areas, int dimension) {
  std::vector<Load> loads;
  for (int axis = 0; axis < dimension; ++axis) {
    Load& load = loads.emplace_back();
    load.components.push_back({axis, value});
    for (std::size_t k = 0; k < areas.points.size(); ++k) {
      const double area = areas.area[k][static_cast<std::size_t>(axis)];
      if (area == 0) continue;
      load.points.push_back(areas.points[k]);
      load.share.push_back(-area);
    }
  }
  return loads;
}

/// Where shares and areas are found: the body of all ranks.
struct Whole {
  TermParts parts;
  std::unique_ptr<Families> families;  ///< null: those of `parts` are of all ranks, or shares are found without them
  std::optional<const ImageMap> images_of_all;
  const ImageMap* images;

  Whole(const Scene& scene, const TermParts& of_rank, const Partition* partition, const ImageMap* of_body, const Images& of_whole)
      : parts(of_rank), images(of_body) {
    using Type = LoadDescription::Type;
    const bool surfaces = std::ranges::any_of(scene.loads, [](const LoadDescription& load) { return load.type == Type::traction || load.type == Type::pressure; });
    if (!partition || !partition->whole() || !surfaces) return;
    families = Families::make(*partition->whole(), of_rank.families->influence(), of_rank.families->needs());
    parts.families = families.get();
    if (!images) return;
    images_of_all.emplace(*partition->whole(), of_whole);
    images = &*images_of_all;
  }
};

}  // namespace

Loads build_loads(const Scene& scene, const TermParts& parts, const Partition* partition, const ImageMap* images, const Images& of_whole,
                  bool quasi_static) {
  const Body& body = parts.families->body();
  const Whole whole(scene, parts, partition, images, of_whole);
  // Where a rank has the whole body shares are found there, else on its part.
  const Body* const of_all = partition ? partition->whole() : nullptr;
  const std::vector<std::int32_t> own = of_all ? own_places(body) : std::vector<std::int32_t>();
  std::vector<Load> loads;
  std::vector<FollowingPressure> pressures;
  for (const LoadDescription& description : scene.loads) {
    refuse_ramp(description.ramp, fmt::format("load.{}", &description - scene.loads.data()), quasi_static);
    if (description.type == LoadDescription::Type::pressure) {
      refuse_pressure(scene, description, parts);
      const SpaceTimeFunction value = function_of(description.components[0], description.ramp, quasi_static);
      SurfaceAreas areas = surface_areas(description, whole.parts, parts, whole.images);
      if (of_all) keep_owned(own, areas.points, areas.area);
      if (description.follower)
        pressures.push_back({value, std::move(areas.points), std::move(areas.area)});
      else
        std::ranges::move(loads_along_axes(value, areas, body.dimension()), std::back_inserter(loads));
      continue;
    }
    Load load = distributed(description, of_all ? *of_all : body, whole.parts, whole.images);
    if (of_all) keep_owned(own, load.points, load.share);
    for (std::size_t c = 0; c < description.components.size(); ++c) {
      const Expression& value = description.components[c];
      if (value.is_number() && value({}) == 0.0) continue;
      load.components.push_back({static_cast<int>(c), function_of(value, description.ramp, quasi_static)});
    }
    if (!load.components.empty()) loads.push_back(std::move(load));
  }
  return Loads(body, std::move(loads), std::move(pressures), images);
}

}  // namespace perikit
