#include "commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <sstream>
#include <system_error>

#include "bench.hpp"
#include "describe.hpp"
#include "new_project.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/run/simulation.hpp"
#include "perikit/run/study.hpp"

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

/// Adds a line to run.log; a full disk must not hide why the run ended.
void log_end(RunRecorder& recorder, const std::string& line) {
  try {
    recorder.log(line);
  } catch (const RunError&) {
  }
}

void run(const Options& options) {
  const auto registry = open_registry(options);
  const Scene scene = read(options, *registry);
  const auto start = std::chrono::steady_clock::now();
  Simulation simulation(scene, *registry);
  const double set_up = seconds_since(start);
  const std::string summary = simulation.summary();   // estimates the step: not after a checkpoint is in place
  if (options.explain) fmt::print("{}", simulation.explanation(*registry));
  const std::filesystem::path folder = options.output.empty() ? std::filesystem::path("out") / scene.file.stem() : options.output;
  RunRecorder recorder(simulation, folder, !options.quiet, options.resume ? RunStart::resume : RunStart::fresh,
                       library_fingerprints(*registry));
  recorder.log(fmt::format("perikit {}: {}\n{}", version(), scene.file.string(), summary));
  if (options.resume) {
    const std::string from = recorder.resumed_step() >= 0 ? fmt::format("resumed after step {}, time {:.6g} s", recorder.resumed_step(), simulation.problem().state().time)
                                                          : "no checkpoint to resume from: the run starts from its initial state";
    recorder.log(from);
    if (!options.quiet) fmt::print("{}\n", from);
  }
  recorder.log(simulation.explanation(*registry));
  for (const RefusedLibrary& refused : registry->refused()) recorder.log(fmt::format("warning: refused {}: {}", refused.file.string(), refused.reason));
  try {
    simulation.run(recorder);
  } catch (const RunError& error) {
    const std::string reason = fmt::format("{}; last good frame: {}", error.what(), recorder.frames() > 0 ? fmt::format("{}", recorder.frames() - 1) : "none");
    log_end(recorder, fmt::format("failed: {}", reason));
    throw RunError(reason);
  }
  const std::string closing = recorder.closing(set_up);
  log_end(recorder, closing);
  if (!options.quiet) fmt::print("{}\nskipped       what the scene does not need: --explain, or {}\n", closing, (folder / "run.log").string());
  if (recorder.cancelled()) {
    const std::string stopped = fmt::format("stopped by a signal after step {}, time {:.6g} s; frame {} and a checkpoint were kept: go on with --resume -o {}",
                                            simulation.problem().state().step, simulation.problem().state().time, recorder.frames() - 1, folder.string());
    log_end(recorder, stopped);
    throw RunError(stopped);
  }
}

void check(const Options& options) {
  const auto registry = open_registry(options);
  const Scene scene = read(options, *registry);
  Simulation simulation(scene, *registry);
  fmt::print("{}\n", scene.resolved);
  // The summary as comments: what is printed is itself a scene.
  std::string summary = simulation.summary();
  if (options.explain) summary += simulation.explanation(*registry);
  std::istringstream lines(summary);
  for (std::string line; std::getline(lines, line);) fmt::print("# {}\n", line);
}

void study(const Options& options) {
  const auto registry = open_registry(options);
  // Runs side by side share the cores.
  if (const int threads = options.threads > 0 ? options.threads : std::max(1, thread_count() / options.jobs); threads != thread_count()) set_thread_count(threads);
  const Study study = read_study(options.scene, *registry);
  const std::filesystem::path folder = options.output.empty() ? std::filesystem::path("out") / study.file.stem() : options.output;
  const auto runner = [&](const Scene& scene, const std::filesystem::path& own) { return run_in_child(scene, *registry, own); };
  const auto progress = [&](const std::string& line) {
    if (!options.quiet) fmt::print("{}\n", line);
    std::fflush(stdout);
  };
  const StudyTable table = run_study(study, *registry, {options.overrides, options.trust}, folder, runner, progress, {options.jobs, options.resume});
  const auto done = std::ranges::count(table.rows, "done", &StudyRow::status);
  if (!options.quiet) fmt::print("\n{}\n{} of {} runs done; table{} in {}\n", table.markdown(), done, table.rows.size(), study.plot ? " and plot" : "", folder.string());
  if (done == 0) throw RunError(fmt::format("no run of the study came to its end; the first: {}", table.rows.front().reason));
}

void list(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", list_parts(*registry, options.kind));
}

void describe(const Options& options) {
  const auto registry = open_registry(options);
  if (!options.markdown && options.part.empty()) throw InputError("name what to describe: KIND/NAME, scene, scene/SECTION or study; --markdown describes everything");
  if (options.markdown && !options.part.empty()) throw InputError("--markdown describes everything: name no part");
  fmt::print("{}", options.markdown ? reference_page(*registry) : describe_part(*registry, options.part));
}

void draw(const Options& options) {
  PlotOptions plot_options = options.plot;
  if (options.frame >= 0) plot_options.frame = options.frame;
  if (!options.unit.empty()) plot_options.unit = options.unit;
  if (options.view.size() == 3) plot_options.view = {options.view[0], options.view[1], options.view[2]};
  if (options.range.size() == 2) plot_options.range = {{options.range[0], options.range[1]}};
  plot_options.output = options.output;
  fmt::print("{}\n", plot(plot_options).string());
}

void measure(const Options& options) {
  const auto registry = open_registry(options);
  if (options.threads > 0) set_thread_count(options.threads);
  bench(*registry, options.bench);
}

void start_project(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", new_project(*registry, options.kind, options.part));
}

/// Becomes the program of the contract suites, which lies beside this one.
void contract(const Options& options) {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "perikit-contract";
  std::vector<std::string> words{program.string(), "--library=" + options.library.string()};
  for (const auto& folder : options.plugin_path) words.push_back("--plugin-path=" + folder.string());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(program.c_str(), arguments.data());
  throw InputError({program.string()}, "", fmt::format("the contract suites cannot be run: {}", std::generic_category().message(errno)));
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
  run_command->add_flag("--resume", options.resume, "Go on from the last checkpoint of the folder");
  run_command->add_flag("--quiet", options.quiet, "No progress, no summary");
  with_scene(add("check", "Check a scene without running it; print it resolved, with sizes, memory and time step", check));
  CLI::App* study_command = add("study", "Run a scene for lists of values of some of its keys; write a table and a work-precision plot", study);
  study_command->add_option("study", options.scene, "Study file (TOML)")->required();
  study_command->add_option("-o,--output", options.output, "Folder for table, plot and runs; default: out/<study>");
  study_command->add_option("--set", options.overrides, "key=value: overrides a value of the scene in every run");
  study_command->add_option("--threads", options.threads, "Threads of each run; default: all cores")->check(CLI::Range(1, 1024));
  study_command->add_option("--jobs", options.jobs, "Runs side by side; the default, 1, is for run times that are to be compared")->default_val(1)->check(CLI::Range(1, 1024));
  study_command->add_flag("--resume", options.resume, "Keep the runs of the folder that are done already");
  study_command->add_flag("--trust", options.trust, "Open the libraries that the scene itself lists");
  study_command->add_flag("--quiet", options.quiet, "No progress, no summary");
  CLI::App* plot_command = add("plot", "Draw a field or a history column of a run", draw);
  plot_command->add_option("results", options.plot.results, "Folder of a run, or its results.h5")->required();
  plot_command->add_option("--field", options.plot.field, "Point field, or history:NAME for a column of history.csv")->capture_default_str();
  plot_command->add_option("--component", options.plot.component, "x, y, z, magnitude; xx ... zz, von_mises, trace, determinant");
  plot_command->add_option("--frame", options.frame, "Frame index; default: the last one");
  plot_command->add_option("--deformed", options.plot.deformed, "Factor of the displacement that is added to the positions");
  plot_command->add_option("--view", options.view, "3D: direction from the body to the eye")->expected(3);
  plot_command->add_option("--range", options.range, "Ends of the colour scale")->expected(2);
  plot_command->add_option("--unit", options.unit, "Unit to show, where the scene is not in SI");
  plot_command->add_option("-o,--output", options.output, "Picture: .png, .svg or .pdf; default: <field>_<frame>.png in the folder of the run");
  CLI::App* bench_command = add("bench", "Speed of the kernels beside the limits of this machine", measure);
  bench_command->add_option("--kinematics", options.bench.kinematics, "Which; with a penalty: conventional+silling; default: all known ones");
  bench_command->add_option("--material", options.bench.materials, "Which")->capture_default_str();
  bench_command->add_option("--dimension", options.bench.dimensions, "1, 2 or 3, or several of them")->check(CLI::Range(1, 3))->allow_extra_args()->capture_default_str();
  bench_command->add_option("--cells", options.bench.cells, "Points along each side")->check(CLI::Range(2, 100000000))->capture_default_str();
  bench_command->add_flag("--assembly", options.bench.assembly, "The assembly of the tangent too; it needs memory: up to tens of kilobytes a point in 3D");
  bench_command->add_option("--json", options.bench.json, "Write the figures to this file as well");
  bench_command->add_option("--operations", options.bench.operations, "CSV of operations a point and step; default: the one that comes with perikit");
  bench_command->add_option("--threads", options.threads, "Threads; default: 1")->default_val(1)->check(CLI::Range(1, 1024));
  CLI::App* new_command = add("new", "Write a project for a part of your own, ready to build", start_project);
  new_command->add_option("kind", options.kind, "kinematics, stabilization, material, damage, influence or integrator")->required();
  new_command->add_option("name", options.part, "Its name, and that of the folder")->required();
  add("contract", "Run the contract suites on every part of a library", contract)
      ->add_option("library", options.library, "Library of parts (FILE.so)")->required();
  add("list", "List the known parts", list)->add_option("kind", options.kind, "kinematics, stabilization, material, damage, influence or integrator");
  CLI::App* describe_command = add("describe", "Describe a part: parameters, equations, source, limits; or the keys of scenes and studies", describe);
  describe_command->add_option("part", options.part, "KIND/NAME, e.g. material/hencky; scene, or scene/SECTION, e.g. scene/output; study");
  describe_command->add_flag("--markdown", options.markdown, "The reference page: everything, as Markdown");
}

}  // namespace perikit::app
