#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench.hpp"
#include "perikit/output/plot.hpp"

namespace perikit::app {

struct Options {
  std::filesystem::path scene, output, library;
  std::vector<std::string> overrides;
  std::vector<std::filesystem::path> plugin_path;
  int threads = 0, jobs = 1;
  bool explain = false, quiet = false, trust = false, resume = false, markdown = false;
  std::string kind, part;
  PlotOptions plot;
  std::int64_t frame = -1;
  std::string unit;
  std::vector<double> view, range;
  BenchOptions bench;
  std::function<void(const Options&)> command;
};

std::string version();
void add_commands(CLI::App& app, Options& options);

}  // namespace perikit::app
