#include "setup/doubts_of_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>

#include "body/family_limit.hpp"
#include "families/normalised_influence.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"
#include "setup/conditions.hpp"

namespace perikit {

namespace {

std::string line(const SourcePosition& position) {
  return position.line > 0 ? fmt::format(" (line {})", position.line) : std::string();
}
std::string place(const Point& x) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]);
}

bool cuts_any(const Crack& crack, const Families& families) {
  const Body& body = families.body();
  FamilyArrays family;
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const Point x = body.position(p);
    if (!crack.near(x, body.horizon())) continue;
    families.load(p, BondsOf::uncut, family);
    for (int k = 0; k < family.bonds; ++k)
      if (crack.cuts(x, body.position(static_cast<std::size_t>(family.far[static_cast<std::size_t>(k)])))) return true;
  }
  return false;
}

void find_idle_cracks(const Scene& scene, const Families& families, std::vector<std::string>& found) {
  if (communicator().size() > 1) return;  // a crack may lie with another rank
  const std::vector<Crack>& cracks = families.body().cracks();
  for (std::size_t k = 0; k < std::min(cracks.size(), scene.cracks.size()); ++k)
    if (!cuts_any(cracks[k], families))
      found.push_back(named("crack", fmt::format("crack.{}{} cuts no bond of the body", k, line(scene.cracks[k].position))));
}

/// Whether a point lies on the crack: a way through it of this share of the spacing, along no plane that a scene is likely to have, is cut.
bool passes_through_points(const Crack& crack, const Body& body) {
  constexpr double share = 1e-5;
  constexpr std::array<double, 3> direction = {1, 0.618, 0.382};
  return std::ranges::any_of(body.owned(), [&](std::int32_t index) {
    Point before = body.position(static_cast<std::size_t>(index)), after = before;
    for (std::size_t a = 0; a < static_cast<std::size_t>(body.dimension()); ++a) {
      before[a] -= share * body.spacing() * direction[a];
      after[a] += share * body.spacing() * direction[a];
    }
    return crack.near(before, body.spacing()) && crack.cuts(before, after);
  });
}

void find_cracks_through_points(const Scene& scene, const Body& body, std::vector<std::string>& found) {
  for (std::size_t k = 0; k < std::min(body.cracks().size(), scene.cracks.size()); ++k)
    if (communicator().largest(passes_through_points(body.cracks()[k], body) ? 1 : 0) > 0)
      found.push_back(named("crack", fmt::format("crack.{}{} passes through points of the body, which all count to one side of it; a crack between two layers of points has no such doubt", k,
                                                 line(scene.cracks[k].position))));
}

/// Loads act on held components, too: there the constraint takes them up.
void find_held_loads(const Scene& scene, const Body& body, const Constraints& constraints, std::vector<std::string>& found) {
  const ConstFieldView free = constraints.free();
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    const LoadDescription& load = scene.loads[k];
    if (load.type == LoadDescription::Type::pressure) continue;   // its direction is that of the surface
    const std::vector<std::int32_t>& points = body.set(load.set);
    for (std::size_t c = 0; c < load.components.size(); ++c) {
      if (load.components[c].is_number() && load.components[c]({}) == 0) continue;
      const auto held =
          std::ranges::count_if(points, [&](std::int32_t p) { return free.component(static_cast<int>(c))[p] == 0; });
      const bool some = load.type == LoadDescription::Type::force;  // of a total, a part is lost
      if (held == 0 || (!some && held < std::ssize(points))) continue;
      found.push_back(named("held_load", fmt::format("load.{}{} acts in {} on {} of {} points that are held in {}, where it moves nothing", k,
                                  line(load.position), "xyz"[c], held, points.size(), "xyz"[c])));
    }
  }
}

/// Held points that are elsewhere, or move otherwise, at the start: they come to where the boundary has them within one step.
void find_jumps(const Scene& scene, const Body& body, bool quasi_static, State& state, std::vector<std::string>& found) {
  if (quasi_static) return;   // load steps go to the first load from any displacement, and say so
  const bool given = !scene.initial_velocity.empty() || scene.initial_from;
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    const BoundaryDescription& boundary = scene.boundaries[k];
    // A velocity from rest is a plain impact.
    if (boundary.holds_side() || (boundary.velocity && !given)) continue;
    const ConstFieldView start = boundary.velocity ? state.velocity() : state.displacement();
    bool told = false;
    for (std::size_t c = 0; c < boundary.components.size() && !told; ++c) {
      if (!boundary.components[c]) continue;
      const SpaceTimeFunction value = function_of(*boundary.components[c], boundary.ramp, quasi_static);
      for (const std::int32_t p : body.set(boundary.set)) {
        const Point x = body.position(static_cast<std::size_t>(p));
        const double there = start.component(static_cast<int>(c))[p], wanted = value(x, 0);
        if (std::abs(there - wanted) <= 1e-9 * std::max(std::abs(there), std::abs(wanted))) continue;
        found.push_back(named("first_step", fmt::format(
            "boundary.{}{} gives the point at {} a {} of {:.6g} in {} at t = 0, where the body starts with {:.6g}", k,
            line(boundary.position), place(x), boundary.velocity ? "velocity" : "displacement", wanted, "xyz"[c], there)));
        told = true;
        break;
      }
    }
  }
}

void find_no_neighbours(const Scene& scene, const Families& families, std::vector<std::string>& found) {
  const Body& body = families.body();
  if (!families.needs().influence) return;
  const double r = relative_length(body.spacing(), body.horizon());
  double omega = 0;
  families.influence()->evaluate({&r, 1}, {&omega, 1});
  if (omega >= 0.01) return;   // of its largest value
  found.push_back(
      named("influence", fmt::format("influence \"{}\" is {:.2g} of its largest value at the nearest neighbours, {:.4g} of the horizon away: "
                  "families are almost empty; a larger horizon helps",
                  scene.influence->type, omega, r)));
}

}  // namespace

std::vector<std::string> questionable(const Scene& scene, const Families& families, const Constraints& constraints,
                                      bool quasi_static, State& state) {
  std::vector<std::string> found;
  find_idle_cracks(scene, families, found);
  find_cracks_through_points(scene, families.body(), found);
  find_held_loads(scene, families.body(), constraints, found);
  find_jumps(scene, families.body(), quasi_static, state, found);
  find_no_neighbours(scene, families, found);
  return found;
}

void refuse_no_influence(const Scene& scene, const InfluenceFunction& influence) {
  const std::string& type = scene.influence->type;
  const auto refused = [&](const std::string& message) {
    const ParameterValues& values = scene.influence->values;
    return InputError(values.position("type"), values.path().empty() ? "family.influence" : values.path(), message);
  };
  double largest = 0;
  try {
    largest = largest_influence(influence);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw refused(fmt::format("influence '{}' failed: {}", type, error.what()));
  } catch (...) {
    throw refused(fmt::format("influence '{}' failed: it threw something that is no std::exception", type));
  }
  if (largest > 0) return;
  throw refused(fmt::format("found \"{}\", which is positive at no distance up to the horizon: no point would have a family; allowed: an influence that is "
                            "positive somewhere",
                            type));
}

}  // namespace perikit
