#include "build/conditions.hpp"

#include <fmt/format.h>

#include "perikit/output/recorder.hpp"

namespace perikit {

SpaceTimeFunction function_of(const Expression& expression, bool ramps) {
  return {expression, expression.depends_on_position(), expression.depends_on_time(), ramps && expression.is_number()};
}

Constraints build_constraints(const Scene& scene, const Body& body, bool quasi_static) {
  std::vector<Prescription> prescriptions;
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    const BoundaryDescription& boundary = scene.boundaries[k];
    if (boundary.velocity && quasi_static)
      throw InputError(boundary.position, fmt::format("boundary.{}.velocity", k),
                       "found in a quasi-static run; allowed: displacement");
    for (std::size_t c = 0; c < boundary.components.size(); ++c) {
      if (!boundary.components[c]) continue;
      prescriptions.push_back(
          {boundary.velocity, static_cast<int>(c), function_of(*boundary.components[c], quasi_static), body.set(boundary.set)});
    }
  }
  return Constraints(body, std::move(prescriptions));
}

namespace {

void fill(const std::vector<std::optional<Expression>>& values, const Body& body, FieldView field) {
  for (std::size_t c = 0; c < values.size(); ++c)
    for (const std::int32_t p : body.owned())
      field.component(static_cast<int>(c))[p] = (*values[c])(body.position(static_cast<std::size_t>(p)));
}

/// The last frame of an earlier run of the same points.
void start_from(const std::filesystem::path& results, const Body& body, const Partition* partition, State& state) {
  const LoadedFrame frame = read_last_frame(results, body.points_of_all_ranks());
  const auto copy = [&](const std::string& name, FieldView field) {
    const OutputField& from = frame.fields.at(name);
    for (const std::int32_t p : body.owned()) {
      const auto place = static_cast<std::size_t>(body.input_of(static_cast<std::size_t>(p)));
      const std::size_t row = partition ? static_cast<std::size_t>(partition->input(place)) : place;
      for (int c = 0; c < field.components; ++c) field.component(c)[p] = from.data[3 * row + static_cast<std::size_t>(c)];
    }
  };
  if (!frame.fields.contains("displacement"))
    throw InputError(fmt::format("{}: the last frame has no displacement", results.string()));
  copy("displacement", state.displacement());
  if (frame.fields.contains("velocity")) copy("velocity", state.velocity());
}

}  // namespace

void set_initial_state(const Scene& scene, const Body& body, const Partition* partition, State& state) {
  if (scene.initial_from) start_from(*scene.initial_from, body, partition, state);
  if (!scene.initial_displacement.empty()) fill(scene.initial_displacement, body, state.displacement());
  if (!scene.initial_velocity.empty()) fill(scene.initial_velocity, body, state.velocity());
}

}  // namespace perikit
