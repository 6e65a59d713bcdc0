#include "body/interfaces.hpp"

#include <algorithm>

#include "body/crossings.hpp"
#include "body/family_limit.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

std::ptrdiff_t Interface::find(std::int32_t p) const noexcept {
  const auto at = std::lower_bound(point.begin(), point.end(), p);
  return at != point.end() && *at == p ? at - point.begin() : -1;
}

Interfaces find_interfaces(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> sources,
                           double reach) {
  Interfaces found;
  if (std::ranges::all_of(material, [&](std::uint16_t m) { return m == material.front(); })) return found;
  // By input number: an order that no layout of the points changes.
  std::vector<Point> places;
  for (const std::int32_t p : body.internal()) places.push_back(body.position(static_cast<std::size_t>(p)));
  const std::size_t real = places.size() - sources.size();
  const auto source = [&](std::size_t n) { return n < real ? n : static_cast<std::size_t>(sources[n - real]); };
  const Boxes boxes(std::move(places), search_radius(body.horizon()));
  const std::vector<Crossing> crossings = find_crossings(body.horizon(), boxes, material);
  found.length = body.horizon();
  found.material.assign(body.stride(), 0);
  found.source.assign(body.stride(), -1);
  const auto internal = body.internal();
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    found.material[static_cast<std::size_t>(internal[n])] = material[n];
    found.source[static_cast<std::size_t>(internal[n])] = internal[source(n)];
  }
  for (auto begin = crossings.begin(); begin != crossings.end();) {
    const auto end = std::find_if(begin, crossings.end(),
                                  [&](const Crossing& c) { return c.first != begin->first || c.second != begin->second; });
    const MaterialSurface surface(body, {begin, end}, lowest_middle({begin, end}), reach);
    std::vector<Distance> distance(boxes.size());
    // What lies beyond a plane of symmetry is the image of what lies before it.
    parallel_for(real, [&](std::size_t n) { distance[n] = surface.distance(boxes.place(n), material[n]); });
    std::vector<std::int32_t> near;
    for (std::size_t n = real; n < boxes.size(); ++n) distance[n] = distance[source(n)];
    for (std::size_t n = 0; n < boxes.size(); ++n)
      if (distance[n].counterpart >= 0) near.push_back(static_cast<std::int32_t>(n));
    std::ranges::sort(near, {}, [&](std::int32_t n) { return internal[static_cast<std::size_t>(n)]; });
    Interface& interface = found.all.emplace_back();
    interface.first = surface.first();
    interface.second = surface.second();
    found.pairs.emplace_back(interface.first, interface.second);
    for (const std::int32_t n : near) {
      const Distance& of = distance[static_cast<std::size_t>(n)];
      interface.point.push_back(internal[static_cast<std::size_t>(n)]);
      interface.distance.push_back(of.value);
      interface.counterpart.push_back(internal[source(static_cast<std::size_t>(of.counterpart))]);
    }
    begin = end;
  }
  return found;
}

}  // namespace perikit
