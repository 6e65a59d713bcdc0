#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "body/partition/near_ranks.hpp"
#include "families/families.hpp"
#include "setup/conditions.hpp"
#include "setup/surfaces/face_shares.hpp"
#include "setup/surfaces/surface_areas.hpp"

namespace perikit {

namespace {

/// The sum of the volumes of the points of a set; of a part of a body of those on all ranks, which must all call it.
double total_volume(const Body& body, const std::vector<std::int32_t>& points) {
  ExactSum total;
  for (const std::int32_t p : points) total.add(body.volume(static_cast<std::size_t>(p)));
  return total_of(body, total);
}

/// Points and shares of a load without its values.
Load distributed(const LoadDescription& description, const TermParts& parts, const ImageMap* images) {
  const Body& body = parts.families->body();
  Load load;
  if (description.type == LoadDescription::Type::traction) {
    FaceShares shares = face_shares(description, parts, images);
    load.points = std::move(shares.points);
    load.share = std::move(shares.share);
    load.rule = std::make_shared<SurfaceRule>(body, load.points, load.share, std::move(shares.samples));
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

Pressure pressure_on(const Body& body, const SpaceTimeFunction& value, SurfaceAreas areas) {
  Pressure pressure{value, std::move(areas.points), std::move(areas.area)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!areas.samples[axis]) continue;
    std::vector<double> share;
    for (const Point& area : pressure.area) share.push_back(area[axis]);
    pressure.rules[axis] = std::make_shared<SurfaceRule>(body, pressure.points, std::move(share), std::move(*areas.samples[axis]));
  }
  return pressure;
}

}  // namespace

Loads build_loads(const Scene& scene, const TermParts& parts, const ImageMap* images, bool quasi_static) {
  const Body& body = parts.families->body();
  std::vector<Load> loads;
  std::vector<Pressure> pressures;
  for (const LoadDescription& description : scene.loads) {
    refuse_ramp(description.ramp, fmt::format("load.{}", &description - scene.loads.data()), quasi_static);
    if (description.type == LoadDescription::Type::pressure) {
      const SpaceTimeFunction value = function_of(description.components[0], description.ramp, quasi_static);
      Pressure pressure = pressure_on(body, value, surface_areas(description, parts, images));
      pressure.follows = description.follower;
      pressures.push_back(std::move(pressure));
      continue;
    }
    Load load = distributed(description, parts, images);
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
