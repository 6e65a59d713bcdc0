#include <fmt/format.h>

#include <algorithm>

#include "build/conditions.hpp"
#include "build/face_shares.hpp"
#include "build/surface_areas.hpp"
#include "families/families.hpp"

namespace perikit {

namespace {

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
  double total = 0;
  for (const std::int32_t p : load.points) total += body.volume(static_cast<std::size_t>(p));
  for (const std::int32_t p : load.points) {
    const double volume = body.volume(static_cast<std::size_t>(p));
    load.share.push_back(description.type == LoadDescription::Type::force ? volume / total : volume);
  }
  return load;
}

/// By internal index of the whole body: where the owned points of a part are in it; -1: others.
std::vector<std::int32_t> own_places(const Partition& partition, const Body& part) {
  std::vector<std::int32_t> own(partition.whole().stride(), -1);
  for (const std::int32_t p : part.owned()) own[static_cast<std::size_t>(part.places().place[static_cast<std::size_t>(p)])] = p;
  return own;
}

/// What of a load on the whole body falls on the points of a part.
void keep_owned(const std::vector<std::int32_t>& own, Load& load) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < load.points.size(); ++k) {
    const std::int32_t place = own[static_cast<std::size_t>(load.points[k])];
    if (place < 0) continue;
    load.points[kept] = place;
    load.share[kept++] = load.share[k];
  }
  load.points.resize(kept);
  load.share.resize(kept);
}

void refuse_pressure(const Scene& scene, const LoadDescription& load, const TermParts& parts) {
  const auto refuse = [&](const std::string& text) { throw InputError(load.position, "load.pressure", text); };
  if (!load.follower) return;
  if (parts.formulation.pairs)
    refuse("found with follower = true and a pair law, which has no deformation gradients; allowed: kinematics with gradients");
  if (std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return !boundary.face.empty(); }))
    refuse(
        "found with follower = true and a [[boundary]] with a face, whose images have no deformation gradient of their own; "
        "allowed: a boundary that holds a set");
}

void add_pressure(const Scene& scene, const LoadDescription& description, const TermParts& parts, const ImageMap* images,
                  bool quasi_static, std::vector<Load>& loads, std::vector<FollowingPressure>& pressures) {
  refuse_pressure(scene, description, parts);
  const SpaceTimeFunction value = function_of(description.components[0], description.ramp, quasi_static);
  SurfaceAreas areas = surface_areas(description, parts, images);
  if (description.follower) {
    pressures.push_back({value, std::move(areas.points), std::move(areas.area)});
    return;
  }
  for (int axis = 0; axis < parts.families->body().dimension(); ++axis) {
    Load load;
    load.components.push_back({axis, value});
    for (std::size_t k = 0; k < areas.points.size(); ++k) {
      const double area = areas.area[k][static_cast<std::size_t>(axis)];
      if (area == 0) continue;
      load.points.push_back(areas.points[k]);
      load.share.push_back(-area);
    }
    if (!load.points.empty()) loads.push_back(std::move(load));
  }
}

}  // namespace

Loads build_loads(const Scene& scene, const TermParts& parts, const Partition* partition, const ImageMap* images, bool quasi_static) {
  const Body& body = parts.families->body();
  TermParts whole = parts;
  std::unique_ptr<Families> of_whole;
  const bool faces = std::ranges::any_of(scene.loads, [](const LoadDescription& load) { return load.type == LoadDescription::Type::traction; });
  if (partition && faces) {
    of_whole = Families::make(partition->whole(), parts.families->influence(), parts.families->needs());
    whole.families = of_whole.get();
  }
  const std::vector<std::int32_t> own = partition ? own_places(*partition, body) : std::vector<std::int32_t>();
  std::vector<Load> loads;
  std::vector<FollowingPressure> pressures;
  for (const LoadDescription& description : scene.loads) {
    refuse_ramp(description.ramp, fmt::format("load.{}", &description - scene.loads.data()), quasi_static);
    if (description.type == LoadDescription::Type::pressure) {
      add_pressure(scene, description, parts, images, quasi_static, loads, pressures);
      continue;
    }
    Load load = distributed(description, partition ? partition->whole() : body, whole, images);
    if (partition) keep_owned(own, load);
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
