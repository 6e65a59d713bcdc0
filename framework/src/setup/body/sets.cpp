#include "setup/body/sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

std::vector<std::int32_t> where_true(const Expression& condition, const Body& body) {
  std::vector<std::int32_t> members;
  for (const std::int32_t index : body.internal())
    if (const auto p = static_cast<std::size_t>(index); !body.image(p) && condition(body.position(p)) != 0.0) members.push_back(index);
  return members;
}

double squared_distance(const Point& a, const Point& b) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

/// Ties within rounding go to the first point.
bool nearer(double squared, double best) {
  return squared < best * (1 - 1e-12);
}

std::int32_t nearest_point(const Point& place, const Body& body) {
  std::int32_t point = -1;
  double best = std::numeric_limits<double>::infinity();
  for (const std::int32_t p : body.internal()) {
    const double squared = squared_distance(body.position(static_cast<std::size_t>(p)), place);
    if (!nearer(squared, best)) continue;
    best = squared;
    point = p;
  }
  return point;
}

/// The same of all ranks: its number. All of them must call it.
std::int64_t nearest_of_all(const Point& place, const ShownPoints& points) {
  struct Near {
    std::int64_t number;
    double squared;
  };
  double least = std::numeric_limits<double>::infinity();
  points([&](const Point& x, std::int64_t) { least = std::min(least, squared_distance(x, place)); });
  least = -communicator().largest(-least);
  std::vector<Near> mine;  // all that may count as equally near
  points([&](const Point& x, std::int64_t number) {
    if (const double squared = squared_distance(x, place); squared <= least * (1 + 1e-11)) mine.push_back({number, squared});
  });
  std::vector<Near> near = told_to_all(gathered<Near>(mine));
  std::ranges::sort(near, {}, &Near::number);
  Near first{-1, std::numeric_limits<double>::infinity()};
  for (const Near& other : near)
    if (nearer(other.squared, first.squared)) first = other;
  return first.number;
}

std::string key_of(const SetDescription& description) {
  return "sets." + description.name;
}

/// points: of the body, on all ranks.
void check_listed(const SetDescription& description, std::int64_t points) {
  const std::string key = key_of(description);
  std::set<std::int64_t> seen;
  for (const std::int64_t p : description.points) {
    if (p < 0 || p >= points)
      throw InputError(description.position, key, fmt::format("found the point {}; allowed: 0 to {}", p, points - 1));
    if (!seen.insert(p).second)
      throw InputError(description.position, key, fmt::format("found the point {} twice; allowed: each point once", p));
  }
}

std::vector<std::int32_t> with_numbers(const std::vector<std::int64_t>& numbers, const Body& body) {
  std::vector<std::int32_t> members;
  for (const std::int64_t number : numbers)
    if (const std::int32_t p = body.find(number); p >= 0) members.push_back(p);
  return members;
}

ShownPoints own_points(const Body& body) {
  return [&body](const auto& visit) {
    for (const std::int32_t p : body.owned())
      visit(body.position(static_cast<std::size_t>(p)), body.number(static_cast<std::size_t>(p)));
  };
}

/// Whether a set has a point on any rank. All of them must call it.
bool any_of_all(const std::vector<std::int32_t>& members) {
  std::int64_t count = std::ssize(members);
  communicator().sum({&count, 1});
  return count > 0 || !communicator().complete();
}

}  // namespace

const Expression* set_expression(const Scene& scene, const std::string& name) {
  const auto set = std::ranges::find(scene.sets, name, &SetDescription::name);
  return set != scene.sets.end() && set->expression ? &*set->expression : nullptr;
}

std::vector<std::int64_t> single_points(const SetDescription& description, const ShownPoints& points) {
  if (description.nearest) return {nearest_of_all(*description.nearest, points)};
  std::int64_t mine = 0;
  points([&](const Point&, std::int64_t) { ++mine; });
  const Counted count = counted(mine);
  check_listed(description, count.all);
  std::vector<std::int64_t> listed = description.points, found;
  std::ranges::sort(listed);
  std::int64_t input = count.before;
  points([&](const Point&, std::int64_t number) {
    if (std::ranges::binary_search(listed, input++)) found.push_back(number);
  });
  return told_to_all(gathered<std::int64_t>(found));
}

void refuse_empty_set(const SetDescription& description) {
  throw InputError(description.position, key_of(description),
                   "found a condition that holds at no point; allowed: one that holds at one point or more");
}

SetMembers add_sets(const std::vector<SetDescription>& sets, Body& body) {
  SetMembers of_all;
  for (const SetDescription& description : sets) {
    std::vector<std::int32_t>& members = of_all[description.name];
    if (description.expression)
      members = where_true(*description.expression, body);
    else if (description.nearest)
      members = body.part() ? with_numbers({nearest_of_all(*description.nearest, own_points(body))}, body)
                            : std::vector{nearest_point(*description.nearest, body)};
    else {
      check_listed(description, static_cast<std::int64_t>(body.points_of_all_ranks()));
      members = with_numbers(description.points, body);
    }
    std::vector<std::int32_t> own = members;
    std::erase_if(own, [&](std::int32_t p) { return !body.owns(static_cast<std::size_t>(p)); });
    if (!any_of_all(own)) refuse_empty_set(description);
    const bool own_order = body.part() && !std::ranges::is_sorted(description.points);
    body.add_set(description.name, std::move(own), own_order ? description.points : std::vector<std::int64_t>());
  }
  return of_all;
}

}  // namespace perikit
