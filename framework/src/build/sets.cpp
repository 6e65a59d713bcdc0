#include "build/sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace perikit {

namespace {

std::vector<std::int32_t> where_true(const Expression& condition, const Body& body) {
  std::vector<std::int32_t> members;
  for (const std::int32_t p : body.internal())
    if (condition(body.position(static_cast<std::size_t>(p))) != 0.0) members.push_back(p);
  return members;
}

std::int32_t nearest_point(const Point& place, const Body& body) {
  std::int32_t point = -1;
  double best = std::numeric_limits<double>::infinity();
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    double r2 = 0;
    for (std::size_t c = 0; c < 3; ++c) r2 += (x[c] - place[c]) * (x[c] - place[c]);
    // Ties within rounding go to the first point.
    if (r2 >= best * (1 - 1e-12)) continue;
    best = r2;
    point = p;
  }
  return point;
}

std::vector<std::int32_t> listed(const SetDescription& description, const std::string& key, const Body& body) {
  std::vector<std::int32_t> members;
  for (const std::int64_t p : description.points) {
    if (p < 0 || static_cast<std::size_t>(p) >= body.points())
      throw InputError(description.position, key, fmt::format("found the point {}; allowed: 0 to {}", p, body.points() - 1));
    const std::int32_t index = body.internal()[static_cast<std::size_t>(p)];
    if (std::ranges::find(members, index) != members.end())
      throw InputError(description.position, key, fmt::format("found the point {} twice; allowed: each point once", p));
    members.push_back(index);
  }
  return members;
}

}  // namespace

void add_sets(const std::vector<SetDescription>& sets, Body& body) {
  for (const SetDescription& description : sets) {
    const std::string key = "sets." + description.name;
    std::vector<std::int32_t> members;
    if (description.expression)
      members = where_true(*description.expression, body);
    else if (description.nearest)
      members = {nearest_point(*description.nearest, body)};
    else
      members = listed(description, key, body);
    if (members.empty())
      throw InputError(description.position, key,
                       "found a condition that holds at no point; allowed: one that holds at one point or more");
    body.add_set(description.name, std::move(members));
  }
}

}  // namespace perikit
