#pragma once
/// Scenes of configs/, ready to run, with overrides.

#include <memory>
#include <string>
#include <vector>

#include "tests/contract/fixture.hpp"

namespace perikit::validation {

/// The parts of this build.
Registry& registry();
/// scene: relative to configs/.
std::unique_ptr<Simulation> load(const std::string& scene, std::vector<std::string> overrides = {});
/// A scene that stands in a test. file: what messages call it, and where its files lie.
std::unique_ptr<Simulation> build(const std::string& text, const std::string& file = "scene.toml");
/// Runs it. Relative distance of the displacement at the end from what the columns of the history call exact.
double error_of_run(Simulation& simulation);

}  // namespace perikit::validation
