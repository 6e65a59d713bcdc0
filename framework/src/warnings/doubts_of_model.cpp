// Models that run without an error and are not what their author means: nothing that acts, laws that lock, sets that rounding decides.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"
#include "warnings/doubts.hpp"

namespace perikit {

namespace {

/// Nearly incompressible from here on: bulk modulus over shear modulus. Measured in a sheared and pressed block under plane strain, 12 by 24 points: forces are 3 to 13 %
/// too large with kinematics of several gradients per point, twice that at 100, 1.2 to 2 times at 1000; with one gradient and a penalty 1.27 times at 20, 12 times
/// at 1000 (framework/docs/which_formulation.md).
constexpr double locks = 50, locks_with_penalty = 20;

void find_locking(const Scene& scene, const BodyProblem& problem, std::vector<std::string>& lines) {
  const Laws& laws = problem.laws();
  const bool free_thickness = laws.space() == Space::plane_stress || problem.dimension() == 1;
  if (free_thickness || !problem.terms().has_gradients() || scene.kinematics->type == "selective") return;
  double ratio = 0;
  for (const std::int32_t p : problem.body().owned()) {
    const Moduli moduli = laws.moduli(static_cast<std::size_t>(p));
    if (moduli.mu > 0) ratio = std::max(ratio, moduli.bulk() / moduli.mu);
  }
  ratio = communicator().largest(ratio);
  if (ratio <= (scene.stabilization ? locks_with_penalty : locks)) return;
  lines.push_back(named("locking", fmt::format("the bulk modulus is {:.4g} times the shear modulus (Poisson's ratio {:.6g}), and kinematics \"{}\" locks: the body is too stiff; "
                                               "kinematics = {{ type = \"selective\", base = \"baqp\" }} does not",
                                               ratio, (3 * ratio - 2) / (6 * ratio + 2), scene.kinematics->type)));
}

bool zero(const Expression& value) {
  return !value.depends_on_time() && !value.depends_on_position() && value({}) == 0;
}

/// A body at rest stays there where nothing acts on it: often a section was forgotten.
void find_nothing_acts(const Scene& scene, std::vector<std::string>& lines) {
  const auto zero_or_free = [](const std::optional<Expression>& value) { return !value || zero(*value); };
  const bool acts =
      scene.initial_from || scene.integrator->type == "evaluate" || !std::ranges::all_of(scene.initial_displacement, zero_or_free) ||
      !std::ranges::all_of(scene.initial_velocity, zero_or_free) ||
      !std::ranges::all_of(scene.loads, [](const LoadDescription& load) { return std::ranges::all_of(load.components, zero); }) ||
      !std::ranges::all_of(scene.boundaries, [&](const BoundaryDescription& boundary) { return std::ranges::all_of(boundary.components, zero_or_free); });
  if (acts) return;
  lines.push_back(named("nothing_acts", "nothing acts on the body, which stays at rest: no load, no prescribed motion and no initial value but 0; [[load]], [[boundary]] or [initial]"));
}

bool held(const Scene& scene, const std::string& set) {
  return std::ranges::any_of(scene.boundaries, [&](const BoundaryDescription& boundary) { return boundary.set == set && !boundary.holds_side(); });
}
bool loaded(const Scene& scene, const std::string& set) {
  return std::ranges::any_of(scene.loads, [&](const LoadDescription& load) { return load.set == set && load.face.empty(); });
}
/// Whether it says what points are made of, or which bonds never fail.
bool names_a_kind(const Scene& scene, const std::string& set) {
  return std::ranges::any_of(scene.regions, [&](const RegionDescription& region) { return region.set == set; }) || std::ranges::find(scene.no_fail, set) != scene.no_fail.end();
}

/// Whether the limit of the condition passes through a place, so that rounding chooses.
bool decided_by_rounding(const Expression& condition, const Point& x, const Body& body) {
  constexpr std::array<double, 3> direction = {1, 0.618, 0.382};   // along no plane that a scene is likely to have
  const double step = 1e-7 * body.spacing();
  Point before = x, after = x;
  for (std::size_t a = 0; a < static_cast<std::size_t>(body.dimension()); ++a) {
    before[a] -= step * direction[a];
    after[a] += step * direction[a];
  }
  return (condition(before) != 0) != (condition(after) != 0);
}

/// The same through points of the body. On a lattice its planes are met all along.
bool decided_by_rounding(const Expression& condition, const Body& body) {
  return std::ranges::any_of(body.owned(), [&](std::int32_t p) { return decided_by_rounding(condition, body.position(static_cast<std::size_t>(p)), body); });
}

/// The same through points of the body, or through those beside it that `inside` left out.
bool surface_decided_by_rounding(const LatticeDescription& lattice, const Body& body) {
  const auto d = static_cast<std::size_t>(body.dimension());
  return std::ranges::any_of(body.owned(), [&](std::int32_t p) {
    const Point x = body.position(static_cast<std::size_t>(p));
    for (std::size_t a = 0; a < d; ++a)
      for (const double cells : {-1.0, 0.0, 1.0}) {
        Point beside = x;
        beside[a] += cells * body.spacing();
        if (beside[a] > lattice.lower[a] && beside[a] < lattice.upper[a] && decided_by_rounding(*lattice.inside, beside, body)) return true;
      }
    return false;
  });
}

/// Sets of boundaries, loads, regions and no_fail that hold other points than their author may think. Bodies of more points than this are not looked at for rounding.
constexpr std::size_t most_points = 300000;

/// A set may be the point nearest to a place: in other units, or beyond a hole, the place is somewhere else. Farther than this many spacings it is told.
constexpr double far_away = 2;

void find_far_places(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  for (const SetDescription& set : scene.sets) {
    if (!set.nearest) continue;
    double distance = 0;
    for (const std::int32_t p : body.set(set.name)) {
      double squared = 0;
      for (std::size_t a = 0; a < static_cast<std::size_t>(body.dimension()); ++a) squared += std::pow(body.position(static_cast<std::size_t>(p))[a] - (*set.nearest)[a], 2);
      distance = std::max(distance, std::sqrt(squared));
    }
    distance = communicator().largest(distance);
    if (distance <= far_away * body.spacing()) continue;
    lines.push_back(named("set", fmt::format("the point of sets.{}{} is {:.4g} m, {:.4g} spacings, away from the place that it is nearest to; a place in the body, in metres", set.name,
                                             set.position.line > 0 ? fmt::format(" (line {})", set.position.line) : std::string(), distance, distance / body.spacing())));
  }
}

void find_strange_sets(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  for (const SetDescription& set : scene.sets) {
    if (!set.expression || !(held(scene, set.name) || loaded(scene, set.name) || names_a_kind(scene, set.name))) continue;
    const std::string place = set.position.line > 0 ? fmt::format(" (line {})", set.position.line) : std::string();
    auto points = static_cast<std::int64_t>(body.set(set.name).size());
    communicator().sum({&points, 1});
    if (points == 1 && body.dimension() > 1 && loaded(scene, set.name))
      lines.push_back(named("set", fmt::format("sets.{}{} has one point, on which a load acts; {{ nearest = [...] }} says so where that is meant", set.name, place)));
    const bool rounding = !scene.random_points() && body.points_of_all_ranks() <= most_points && decided_by_rounding(*set.expression, body);
    if (communicator().largest(rounding ? 1 : 0) > 0)
      lines.push_back(named("set", fmt::format("the limit of sets.{}{} passes through points of the lattice: rounding decides which of them are in it; a limit between two layers is safe",
                                               set.name, place)));
  }
}

void find_ragged_surface(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  if (!scene.body.lattice || !scene.body.lattice->inside || scene.partial_volume || scene.random_points()) return;
  const bool rounding = body.points_of_all_ranks() <= most_points && surface_decided_by_rounding(*scene.body.lattice, body);
  if (communicator().largest(rounding ? 1 : 0) > 0)
    lines.push_back(named("set", "the surface of [body.lattice] inside passes through points of the lattice: rounding decides which of them are in the body; a surface between two layers is safe"));
}

}  // namespace

void find_doubts_of_model(const Scene& scene, const BodyProblem& problem, std::vector<std::string>& lines) {
  find_locking(scene, problem, lines);
  find_nothing_acts(scene, lines);
  find_strange_sets(scene, problem.body(), lines);
  find_far_places(scene, problem.body(), lines);
  find_ragged_surface(scene, problem.body(), lines);
}

}  // namespace perikit
