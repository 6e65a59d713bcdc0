#include "body/interfaces.hpp"

#include <algorithm>

#include "body/crossings.hpp"
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
  const Boxes boxes(std::move(places), body.horizon() * (1 + 1e-9));
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

Interfaces interfaces_of_part(const Body& part, const Body& whole, const Interfaces& known) {
  Interfaces found;
  found.notes = known.notes;
  if (known.empty()) return found;
  found.length = known.length;
  found.material.assign(part.stride(), 0);
  found.source.assign(part.stride(), -1);
  std::vector<std::int32_t> here(whole.stride(), -1);  // by internal index of the whole body
  for (const std::int32_t index : part.internal()) {
    const auto p = static_cast<std::size_t>(index);
    const auto original = static_cast<std::size_t>(whole.internal()[static_cast<std::size_t>(part.number(p))]);
    here[original] = index;
    found.material[p] = known.material[original];
  }
  for (const std::int32_t index : part.internal()) {
    const auto original = static_cast<std::size_t>(whole.internal()[static_cast<std::size_t>(part.number(static_cast<std::size_t>(index)))]);
    found.source[static_cast<std::size_t>(index)] = here[static_cast<std::size_t>(known.source[original])];
  }
  for (const Interface& from : known.all) {
    std::vector<std::pair<std::int32_t, std::size_t>> points;
    for (std::size_t at = 0; at < from.point.size(); ++at)
      if (const std::int32_t p = here[static_cast<std::size_t>(from.point[at])]; p >= 0) points.push_back({p, at});
    if (points.empty()) continue;
    std::ranges::sort(points);
    Interface& to = found.all.emplace_back();
    to.first = from.first;
    to.second = from.second;
    for (const auto& [p, at] : points) {
      to.point.push_back(p);
      to.distance.push_back(from.distance[at]);
      // -1 where it lies on another rank: there constants are those of the material.
      to.counterpart.push_back(here[static_cast<std::size_t>(from.counterpart[at])]);
    }
  }
  return found;
}

}  // namespace perikit
