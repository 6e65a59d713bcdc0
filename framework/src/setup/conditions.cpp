#include "setup/conditions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/each_once.hpp"
#include "output/recorder.hpp"
#include "output/result_file.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

double end_of(const Scene& scene, bool quasi_static) {
  const ParameterValues& integrator = scene.integrator->values;
  return quasi_static ? 1.0 : integrator.has("end_time") ? integrator.number("end_time") : 0.0;
}

SpaceTimeFunction function_of(const Expression& expression, const RampDescription& ramp, bool quasi_static) {
  const bool ramps = quasi_static && ramp.given.value_or(true) && !expression.depends_on_time();
  return {expression, expression.depends_on_position(), expression.depends_on_time(), ramps};
}

void refuse_ramp(const RampDescription& ramp, const std::string& key, bool quasi_static) {
  if (ramp.given && !quasi_static)
    throw InputError(ramp.position, key + ".ramp", "found it in a run without load parameter; allowed: in quasi-static runs");
}

namespace {

/// A point at a held face that a layer holds too would be held at two places. Of a part of a body all ranks must call it.
void refuse_twice(const Scene& scene, const Body& body, const Images& images, const std::vector<Prescription>& prescriptions,
                  const std::vector<std::size_t>& boundary_of, const std::vector<FaceMotion>& motions) {
  if (prescriptions.empty() || std::ranges::none_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.holds_side(); }))
    return;
  struct Held {
    std::int64_t number, component;
    auto operator<=>(const Held&) const = default;
  };
  std::vector<Held> held;
  for (const ImageTerm& term : images.terms)
    if (term.motion >= 0 && !motions[static_cast<std::size_t>(term.motion)].of_set) held.push_back({term.surface, term.component});
  keep_each_once(held);
  if (body.part()) held = told_to_all(gathered<Held>(held));
  keep_each_once(held);
  for (std::size_t k = 0; k < prescriptions.size(); ++k)
    for (const std::int32_t p : prescriptions[k].points) {
      if (!std::ranges::binary_search(held, Held{body.number(static_cast<std::size_t>(p)), prescriptions[k].component})) continue;
      const Point x = body.position(static_cast<std::size_t>(p));
      throw InputError(scene.boundaries[boundary_of[k]].position, fmt::format("boundary.{}", boundary_of[k]),
                       fmt::format("found the point at ({:.6g}, {:.6g}, {:.6g}) held in {}, and its face by another [[boundary]]; allowed: one of "
                                   "them", x[0], x[1], x[2], "xyz"[prescriptions[k].component]));
    }
}

/// The time at which two prescriptions do not say the same of a component at x, of the start, half-way and the end.
std::optional<double> contradiction(const Prescription& a, const Prescription& b, const Point& x, double end) {
  if (a.velocity != b.velocity) {
    const Prescription &moves = a.velocity ? a : b, &stays = a.velocity ? b : a;
    const bool still = !stays.value.varies() && !moves.value.varies() && moves.value(x, 0) == 0;
    return still ? std::nullopt : std::optional(end);
  }
  for (const double t : {0.0, 0.5 * end, end}) {
    const double u = a.value(x, t), v = b.value(x, t);
    if (std::abs(u - v) > 1e-12 * std::max(std::abs(u), std::abs(v))) return t;
  }
  return std::nullopt;
}

/// Boundaries whose sets overlap must agree there.
void refuse_contradictions(const Scene& scene, const Body& body, const std::vector<Prescription>& prescriptions, const std::vector<std::size_t>& boundary_of,
                           bool quasi_static) {
  const double end = end_of(scene, quasi_static);
  std::vector<std::int32_t> first(body.stride() * static_cast<std::size_t>(body.dimension()), -1);
  for (std::size_t k = 0; k < prescriptions.size(); ++k)
    for (const std::int32_t p : prescriptions[k].points) {
      std::int32_t& other = first[static_cast<std::size_t>(prescriptions[k].component) * body.stride() + static_cast<std::size_t>(p)];
      if (other < 0) {
        other = static_cast<std::int32_t>(k);
        continue;
      }
      const Prescription& before = prescriptions[static_cast<std::size_t>(other)];
      const Point x = body.position(static_cast<std::size_t>(p));
      const std::optional<double> when = contradiction(before, prescriptions[k], x, end);
      if (!when) continue;
      const std::size_t j = boundary_of[static_cast<std::size_t>(other)], own = boundary_of[k];
      const auto what = [&](const Prescription& prescription) { return fmt::format("a {} of {:.6g}", prescription.velocity ? "velocity" : "displacement", prescription.value(x, *when)); };
      throw InputError(scene.boundaries[own].position, fmt::format("boundary.{}", own),
                       fmt::format("found {} in {} at t = {:.4g} for the point at ({:.6g}, {:.6g}, {:.6g}), which boundary.{} (line {}) gives {}; allowed: the same motion, or sets that "
                                   "do not overlap",
                                   what(prescriptions[k]), "xyz"[prescriptions[k].component], *when, x[0], x[1], x[2], j, scene.boundaries[j].position.line, what(before)));
    }
}

}  // namespace

Constraints build_constraints(const Scene& scene, const Body& body, const Images& images, std::vector<FaceMotion> motions, bool quasi_static) {
  std::vector<Prescription> prescriptions;
  std::vector<std::size_t> boundary_of;
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    const BoundaryDescription& boundary = scene.boundaries[k];
    if (boundary.velocity && quasi_static)
      throw InputError(boundary.position, fmt::format("boundary.{}.velocity", k),
                       "found in a quasi-static run; allowed: displacement");
    refuse_ramp(boundary.ramp, fmt::format("boundary.{}", k), quasi_static);
    if (boundary.holds_side()) continue;  // the images have it
    for (std::size_t c = 0; c < boundary.components.size(); ++c) {
      if (!boundary.components[c]) continue;
      prescriptions.push_back({boundary.velocity, static_cast<int>(c),
                               function_of(*boundary.components[c], boundary.ramp, quasi_static), body.set(boundary.set)});
      boundary_of.push_back(k);
    }
  }
  refuse_twice(scene, body, images, prescriptions, boundary_of, motions);
  refuse_contradictions(scene, body, prescriptions, boundary_of, quasi_static);
  try {
    return Constraints(body, std::move(prescriptions), images, std::move(motions));
  } catch (const std::domain_error& error) {
    for (std::size_t k = 0; k < scene.boundaries.size(); ++k)
      if (scene.boundaries[k].velocity && scene.boundaries[k].holds_side()) throw InputError(scene.boundaries[k].position, fmt::format("boundary.{}.velocity", k), error.what());
    throw;
  }
}

namespace {

void fill(const std::vector<std::optional<Expression>>& values, const Body& body, FieldView field) {
  for (std::size_t c = 0; c < values.size(); ++c)
    for (const std::int32_t p : body.owned())
      field.component(static_cast<int>(c))[p] = (*values[c])(body.position(static_cast<std::size_t>(p)));
}

/// Points of the same body have the same places up to this share of their distance, and the same volumes up to this share: what a
/// generator of points that runs again, and cells that are cut on other ranks, round otherwise.
constexpr double same_place = 1e-6;

/// Refuses results of another body. All ranks must call it: they look at their own points, and the first one in input order that
/// differs is told.
void refuse_other_body(const Scene& scene, const Body& body, std::span<const std::int64_t> numbers) {
  constexpr double none = std::numeric_limits<double>::infinity();
  double mine = none;
  std::string message;
  ResultFile(*scene.initial_from).each_point(numbers, [&](std::size_t k, std::span<const double> there, double volume) {
    if (mine < none) return;
    const auto p = static_cast<std::size_t>(body.owned()[k]);
    const Point x = body.position(p);
    double square = 0, farthest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      square += (there[c] - x[c]) * (there[c] - x[c]);
      farthest = std::max(farthest, std::abs(x[c]));
    }
    const double distance = std::sqrt(square), rounding = 8 * std::numeric_limits<double>::epsilon() * farthest;
    if (distance <= same_place * body.spacing() + rounding && std::abs(volume - body.volume(p)) <= same_place * body.volume(p)) return;
    mine = static_cast<double>(numbers[k]);
    message = fmt::format("found {}, results of another body: its point {} lies at ({:.6g}, {:.6g}, {:.6g}) and has {:.6g} m^3, that of this scene lies at ({:.6g}, {:.6g}, {:.6g}) and has "
                          "{:.6g} m^3; allowed: results of the same points, with the same volumes and in the same order",
                          scene.initial_from->string(), numbers[k], there[0], there[1], there[2], volume, x[0], x[1], x[2], body.volume(p));
  });
  const double first = -communicator().largest(-mine);
  if (first < none) throw InputError(scene.initial_from_position, "initial.from", first_message(mine == first ? message : ""));
}

/// The last frame of an earlier run of the same points.
void start_from(const Scene& scene, const Body& body, State& state) {
  const std::filesystem::path& results = *scene.initial_from;
  const LastFrame frame(results, body.points_of_all_ranks());
  const std::vector<std::int64_t> numbers = body.numbers(body.owned());
  refuse_other_body(scene, body, numbers);
  const auto copy = [&](const std::string& name, FieldView field) {
    frame.each_row(name, numbers, [&](std::size_t k, std::span<const double> row) {
      for (int c = 0; c < field.components; ++c) field.component(c)[body.owned()[k]] = row[static_cast<std::size_t>(c)];
    });
  };
  if (!frame.fields().contains("displacement"))
    throw InputError(fmt::format("{}: the last frame has no displacement", results.string()));
  copy("displacement", state.displacement());
  if (frame.fields().contains("velocity")) copy("velocity", state.velocity());
}

}  // namespace

void set_initial_state(const Scene& scene, const Body& body, const Constraints& constraints, bool quasi_static, State& state) {
  for (const BoundaryDescription& boundary : scene.boundaries)
    if (scene.initial_from && (boundary.velocity || quasi_static) && boundary.holds_side())
      throw InputError(boundary.position, "boundary",
                       "found a face together with initial.from, whose results do not say where the face was; allowed: in "
                       "explicit runs a face with a displacement");
  constraints.start_images(
      [&](int c, const Point& x) {
        return scene.initial_displacement.empty() ? 0.0 : (*scene.initial_displacement[static_cast<std::size_t>(c)])(x);
      },
      !quasi_static, state.displacement());
  if (scene.initial_from) start_from(scene, body, state);
  if (!scene.initial_displacement.empty()) fill(scene.initial_displacement, body, state.displacement());
  if (!scene.initial_velocity.empty()) fill(scene.initial_velocity, body, state.velocity());
}

}  // namespace perikit
