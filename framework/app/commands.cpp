#include "commands.hpp"

#include <fmt/format.h>

#include <chrono>

#include "describe.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/run/simulation.hpp"

namespace perikit::app {

namespace {

std::unique_ptr<Registry> open_registry(const Options& options) {
  auto registry = std::make_unique<Registry>();
  for (const auto& folder : Registry::standard_search_path(options.plugin_path)) registry->add_folder(folder);
  return registry;
}

Scene read(const Options& options, Registry& registry) {
  if (options.threads > 0) set_thread_count(options.threads);
  return read_scene(options.scene, registry, {options.overrides, options.trust});
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void run(const Options& options) {
  const auto registry = open_registry(options);
  const Scene scene = read(options, *registry);
  const auto start = std::chrono::steady_clock::now();
  Simulation simulation(scene, *registry);
  const double set_up = seconds_since(start);
  if (options.explain) fmt::print("{}", simulation.explanation(*registry));
  const std::filesystem::path folder = options.output.empty() ? std::filesystem::path("out") / scene.file.stem() : options.output;
  RunRecorder recorder(simulation, folder, !options.quiet);
  recorder.log(fmt::format("perikit {}: {}\n{}", version(), scene.file.string(), simulation.summary()));
  recorder.log(simulation.explanation(*registry));
  for (const RefusedLibrary& refused : registry->refused()) recorder.log(fmt::format("warning: refused {}: {}", refused.file.string(), refused.reason));
  const auto running = std::chrono::steady_clock::now();
  try {
    simulation.run(recorder);
  } catch (const RunError& error) {
    recorder.log(fmt::format("failed: {}\nlast good frame: {}", error.what(), recorder.frames() - 1));
    throw;
  }
  const double spent = seconds_since(running);
  const BodyProblem& problem = simulation.problem();
  const auto steps = static_cast<double>(const_cast<BodyProblem&>(problem).step());
  const std::string end = fmt::format("set-up {:.2f} s, run {:.2f} s, {:.0f} steps, {:.3g} ns a point and step, {} frames in {}", set_up, spent, steps,
                                      steps > 0 ? spent / steps / static_cast<double>(problem.points()) * 1e9 : 0.0, recorder.frames(), folder.string());
  recorder.log(end);
  if (!options.quiet) fmt::print("{}\n", end);
  if (recorder.cancelled()) throw RunError("stopped by a signal; every finished frame was kept");
}

void check(const Options& options) {
  const auto registry = open_registry(options);
  const Scene scene = read(options, *registry);
  Simulation simulation(scene, *registry);
  fmt::print("{}\n", scene.resolved);
  // The summary as comments: what is printed is itself a scene.
  std::string summary = simulation.summary();
  if (options.explain) summary += simulation.explanation(*registry);
  std::size_t begin = 0;
  while (begin < summary.size()) {
    const std::size_t end = summary.find('\n', begin);
    fmt::print("# {}\n", summary.substr(begin, end - begin));
    begin = end == std::string::npos ? summary.size() : end + 1;
  }
}

void list(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", list_parts(*registry, options.kind));
}

void describe(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", describe_part(*registry, options.part));
}

}  // namespace

std::string version() { return PERIKIT_VERSION; }

void add_commands(CLI::App& app, Options& options) {
  const auto add = [&](const char* name, const char* text, void (*command)(const Options&)) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->callback([&options, command] { options.command = command; });
    sub->add_option("--plugin-path", options.plugin_path, "Further folders of plugins, searched first");
    return sub;
  };
  const auto with_scene = [&](CLI::App* sub) {
    sub->add_option("scene", options.scene, "Scene file (TOML)")->required();
    sub->add_option("--set", options.overrides, "key=value: overrides a value of the scene, e.g. integrator.end_time=1e-3");
    sub->add_option("--threads", options.threads, "Threads; default: all cores")->check(CLI::Range(1, 1024));
    sub->add_flag("--trust", options.trust, "Open the libraries that the scene itself lists");
    sub->add_flag("--explain", options.explain, "Print what is skipped, why, and what that saves");
  };
  CLI::App* run_command = add("run", "Run a scene", run);
  with_scene(run_command);
  run_command->add_option("-o,--output", options.output, "Folder for the results; default: out/<scene>");
  run_command->add_flag("--quiet", options.quiet, "No progress, no summary");
  with_scene(add("check", "Check a scene without running it; print it resolved, with sizes, memory and time step", check));
  add("list", "List the known parts", list)->add_option("kind", options.kind, "kinematics, stabilization, material, damage, influence or integrator");
  add("describe", "Describe a part: parameters, equations, source, limits", describe)->add_option("part", options.part, "KIND/NAME")->required();
}

}  // namespace perikit::app
