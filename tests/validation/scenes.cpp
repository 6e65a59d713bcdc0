#include "tests/validation/scenes.hpp"

#include <cmath>

#include "tests/contract/integrator_fixture.hpp"

namespace perikit::validation {

Registry& registry() {
  Registry& parts = contract::subject().registry;
  static const bool filled = [&] {
    for (const auto& folder : Registry::standard_search_path({PERIKIT_PLUGIN_FOLDER})) parts.add_folder(folder);
    return true;
  }();
  static_cast<void>(filled);
  return parts;
}

std::unique_ptr<Simulation> load(const std::string& scene, std::vector<std::string> overrides) {
  const std::string file = std::string(PERIKIT_SOURCE_FOLDER) + "/configs/" + scene;
  return std::make_unique<Simulation>(read_scene(file, registry(), {.overrides = std::move(overrides)}), registry());
}

std::unique_ptr<Simulation> build(const std::string& text, const std::string& file) {
  return std::make_unique<Simulation>(parse_scene(text, file, registry()), registry());
}

double error_of_run(Simulation& simulation) {
  contract::run(simulation);
  BodyProblem& problem = simulation.problem();
  double distance = 0, size = 0;
  for (const HistoryDescription& record : simulation.scene().output.history) {
    if (!record.exact) continue;
    const double* u = problem.state().displacement().component(record.component[0] - 'x');
    for (const std::int32_t p : problem.body().owned()) {
      const double exact = (*record.exact)(problem.body().position(static_cast<std::size_t>(p)), problem.state().time);
      distance += (u[p] - exact) * (u[p] - exact);
      size += exact * exact;
    }
  }
  return std::sqrt(distance / size);
}

}  // namespace perikit::validation
