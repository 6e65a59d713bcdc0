#pragma once
/// Runs that are recorded in a folder, and what they leave there.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "output/history_file.hpp"
#include "tests/kit/registry.hpp"

namespace perikit::test {

/// Runs a scene, records it in `folder` and returns its columns of history.
inline std::map<std::string, std::vector<double>> columns_of(const std::string& scene, const std::filesystem::path& folder) {
  const auto simulation = simulation_of(scene);
  {
    RunRecorder recorder(*simulation, folder, false);
    simulation->run(recorder);
    recorder.finish();
  }
  const History history = read_history(folder / "history.csv");
  std::map<std::string, std::vector<double>> columns;
  for (std::size_t k = 0; k < history.columns.size(); ++k) columns[history.columns[k]] = history.values[k];
  return columns;
}

}  // namespace perikit::test
