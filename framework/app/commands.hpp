#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bench.hpp"
#include "output/plot.hpp"

namespace perikit::app {

enum Exit { done = 0, run_failed = 1, input_refused = 2 };

/// What the words of the command line say.
struct Options {
  void (*command)(const Options&) = nullptr;  ///< one of those below
  std::filesystem::path scene, output, library;
  std::filesystem::path machine_values;   ///< of check --machine: the file to write
  std::vector<std::string> overrides;
  std::vector<std::filesystem::path> plugin_path;
  int threads = 0, jobs = 1, ranks = 1;
  bool explain = false, quiet = false, keep_going = false, trust = false, resume = false, force = false, markdown = false, machine = false;
  std::string kind, part;
  bool history = false;           ///< of a new material
  PlotOptions plot;
  std::int64_t frame = -1;
  std::string unit;
  std::vector<double> view, range, window;
  BenchOptions bench;
};

/// "0.1.0 (x86-64-v4)": with the level that it is built for.
std::string version();

// What the program does, each under the name of its command. They throw InputError and RunError.
void run(const Options& options);
void check(const Options& options);
void study(const Options& options);
void plot(const Options& options);
void bench(const Options& options);
void start_project(const Options& options);  ///< perikit new
void contract(const Options& options);
void list(const Options& options);
void describe(const Options& options);

}  // namespace perikit::app
