#include "body/interfaces.hpp"

#include <algorithm>
#include <tuple>

#include "body/crossings.hpp"
#include "body/family_limit.hpp"
#include "body/partition/near_ranks.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

std::ptrdiff_t Interface::find(std::int32_t p) const noexcept {
  const auto at = std::lower_bound(point.begin(), point.end(), p);
  return at != point.end() && *at == p ? at - point.begin() : -1;
}

namespace {

/// Two materials, and the lowest coordinates of the midpoints between them.
struct Meeting {
  std::uint16_t first, second;
  Point lower;
};

/// The pair of materials that the crossing at `begin` is of: where its crossings end.
template <class At>
At end_of_pair(At begin, At end) {
  return std::find_if(begin, end, [&](const Crossing& c) { return c.first != begin->first || c.second != begin->second; });
}

/// All pairs on all ranks, ascending.
std::vector<Meeting> meetings_of_all(std::span<const Crossing> own) {
  std::vector<Meeting> mine;
  for (auto begin = own.begin(); begin != own.end();) {
    const auto end = end_of_pair(begin, own.end());
    mine.push_back({begin->first, begin->second, lowest_middle({begin, end})});
    begin = end;
  }
  std::vector<Meeting> all;
  std::vector<Meeting> found = gathered<Meeting>(mine);
  std::ranges::stable_sort(found, {}, [](const Meeting& m) { return std::pair(m.first, m.second); });
  for (const Meeting& meeting : found) {
    if (all.empty() || all.back().first != meeting.first || all.back().second != meeting.second) all.push_back(meeting);
    for (std::size_t a = 0; a < 3; ++a) all.back().lower[a] = std::min(all.back().lower[a], meeting.lower[a]);
  }
  return told_to_all(all);
}

/// What distances up to `reach` depend on: crossings a bond farther, and of each the midpoints in the window of its plane.
double reach_of_midpoints(const Body& body, double reach) {
  return reach + 4.1 * body.horizon();
}

/// How far from the points of a rank others matter: the ends of bonds to these midpoints, and what may be nearer to them.
double surroundings(const Body& body, double reach) {
  return reach_of_midpoints(body, reach) + 1.6 * body.horizon();
}

/// A point near which materials meet: one that has a point of another material in its family, or nearly so.
struct MeetingPoint {
  Point x;
  std::int64_t place, source, number;  ///< in the whole body; source: the place of what an image is of, else its own
  std::int64_t material;
};

/// Those of the rank. source: by internal index.
std::vector<MeetingPoint> own_meeting_points(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> source,
                                             const Boxes& boxes) {
  std::vector<MeetingPoint> meeting;
  const auto place = [&](std::int32_t p) { return body.part() ? body.places().place[static_cast<std::size_t>(p)] : p; };
  const std::vector<std::uint8_t> differing = boxes.differing(material);
  for (std::size_t n = 0; n < differing.size(); ++n) {
    const std::int32_t point = body.internal()[n];
    const auto p = static_cast<std::size_t>(point);
    if (differing[n] && body.owns(p)) meeting.push_back({boxes.place(n), place(point), place(source[p]), body.number(p), material[n]});
  }
  return meeting;
}

/// Those of all ranks that matter to this one, in input order.
std::vector<MeetingPoint> meeting_points(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> source,
                                         double reach) {
  std::vector<Point> places;
  for (const std::int32_t p : body.internal()) places.push_back(body.position(static_cast<std::size_t>(p)));
  const std::vector<MeetingPoint> own = own_meeting_points(body, material, source, Boxes(std::move(places), search_radius(body.horizon())));
  std::vector<MeetingPoint> all = of_ranks_near(body, own, surroundings(body, reach));
  std::ranges::sort(all, {}, &MeetingPoint::number);
  return all;
}

}  // namespace

Interfaces find_interfaces(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> sources,
                           double reach) {
  const Bounds bounds = bounds_of(body);
  const auto internal = body.internal();
  const std::size_t real = internal.size() - sources.size();
  const auto source = [&](std::size_t n) { return n < real ? n : static_cast<std::size_t>(sources[n - real]); };
  const auto at_place = [&](std::int64_t place) { return body.part() ? body.at_place(place) : static_cast<std::int32_t>(place); };
  Interfaces found;
  found.source.assign(body.stride(), -1);
  for (std::size_t n = 0; n < internal.size(); ++n) found.source[static_cast<std::size_t>(internal[n])] = internal[source(n)];
  const std::vector<MeetingPoint> meeting = meeting_points(body, material, found.source, reach);
  std::vector<Point> places;
  std::vector<std::uint16_t> of_meeting;
  for (const MeetingPoint& point : meeting) {
    places.push_back(point.x);
    of_meeting.push_back(static_cast<std::uint16_t>(point.material));
  }
  std::vector<Crossing> crossings =
      find_crossings(body.horizon(), Boxes(std::move(places), search_radius(body.horizon())), of_meeting);
  // Farther ones may not be what they are in the whole body.
  std::erase_if(crossings, [&](const Crossing& c) { return !bounds.near(c.middle, reach_of_midpoints(body, reach)); });
  std::vector<Crossing> own;
  std::ranges::copy_if(crossings, std::back_inserter(own), [&](const Crossing& c) {
    const std::int32_t p = at_place(meeting[static_cast<std::size_t>(c.of_first)].place);
    return p >= 0 && body.owns(static_cast<std::size_t>(p));
  });
  const std::vector<Meeting> all = meetings_of_all(own);
  if (all.empty()) return {};
  for (const Meeting& pair : all) found.pairs.emplace_back(pair.first, pair.second);
  found.length = body.horizon();
  found.material.assign(body.stride(), 0);
  for (std::size_t n = 0; n < internal.size(); ++n) found.material[static_cast<std::size_t>(internal[n])] = material[n];
  for (auto begin = crossings.begin(); begin != crossings.end();) {
    const auto end = end_of_pair(begin, crossings.end());
    const auto pair = std::ranges::find(all, std::pair(begin->first, begin->second),
                                        [](const Meeting& m) { return std::pair(m.first, m.second); });
    const MaterialSurface surface(body, {begin, end}, pair->lower, reach);
    begin = end;
    std::vector<Distance> distance(internal.size());
    // What lies beyond a plane of symmetry is the image of what lies before it.
    parallel_for(real, [&](std::size_t n) {
      distance[n] = surface.distance(body.position(static_cast<std::size_t>(internal[n])), material[n]);
    });
    for (std::size_t n = real; n < internal.size(); ++n) distance[n] = distance[source(n)];
    std::vector<std::pair<std::int32_t, std::size_t>> near;
    for (std::size_t n = 0; n < internal.size(); ++n)
      if (distance[n].counterpart >= 0) near.emplace_back(internal[n], n);
    if (near.empty()) continue;
    std::ranges::sort(near);
    Interface& interface = found.all.emplace_back();
    interface.first = surface.first();
    interface.second = surface.second();
    for (const auto& [p, n] : near) {
      interface.point.push_back(p);
      interface.distance.push_back(distance[n].value);
      interface.counterpart.push_back(at_place(meeting[static_cast<std::size_t>(distance[n].counterpart)].source));
    }
  }
  return found;
}

}  // namespace perikit
