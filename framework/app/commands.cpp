#include "commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <sstream>
#include <system_error>

#include "bench.hpp"
#include "core/messages.hpp"
#include "data_folder.hpp"
#include "describe.hpp"
#include "machine_check.hpp"
#include "new_project.hpp"
#include "output/plot.hpp"
#include "peak_memory.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/warnings.hpp"
#include "perikit/plugin/abi.hpp"
#include "ranks.hpp"
#include "run/simulation.hpp"
#include "setup/body/body.hpp"
#include "study/study.hpp"

namespace perikit::app {

namespace {

std::unique_ptr<Registry> open_registry(const Options& options) {
  auto registry = std::make_unique<Registry>();
  for (const auto& folder : Registry::standard_search_path(options.plugin_path)) registry->add_folder(folder);
  return registry;
}

Scene read(const Options& options, Registry& registry) {
  if (options.threads > 0)
    set_thread_count(options.threads);
  else if (communicator().size() > 1)
    set_thread_count(cores_of_rank());
  Scene scene = read_scene(options.scene, registry, {options.overrides, options.trust});
  if (options.threads > 0) scene.threads = options.threads;
  return scene;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What the set-up is at, on a terminal; gone when it is over, whatever its end.
class SetUpLine {
 public:
  explicit SetUpLine(bool shown) : shown_(shown) {}
  SetUpLine(const SetUpLine&) = delete;
  SetUpLine& operator=(const SetUpLine&) = delete;
  ~SetUpLine() {
    if (shown_) tell("\r\033[K");
  }
  void write(const std::string& step) const {
    if (shown_) tell(fmt::format("\r\033[Kset-up: {}", step));
  }

 private:
  bool shown_;
};

/// Adds a line to run.log; a full disk must not hide why the run ended.
void log_end(RunRecorder& recorder, const std::string& line) {
  try {
    recorder.log(line);
  } catch (const RunError&) {
  }
}

}  // namespace

std::string version() { return PERIKIT_VERSION " (" PERIKIT_LEVEL ")"; }

void run(const Options& options) {
  std::optional<NothingToKeep> set_up_alone(std::in_place);
  TimesBefore before{.begin = std::chrono::steady_clock::now()};
  const auto registry = open_registry(options);
  const Scene scene = read(options, *registry);
  const bool show = !options.quiet && communicator().rank() == 0 && isatty(STDERR_FILENO);
  auto line = std::make_unique<SetUpLine>(show);
  Simulation simulation(scene, *registry, [&](const std::string& step) { line->write(step); });
  simulation.tell_limits(*registry);
  before.set_up = seconds_since(before.begin);
  const auto planning = std::chrono::steady_clock::now();
  const bool first = communicator().rank() == 0;     // which alone speaks
  simulation.set_up().begin("plan of the steps");
  const std::string summary = simulation.summary();  // estimates the step: not after a checkpoint is in place
  simulation.refuse_memory();
  simulation.set_up().end();
  line.reset();
  before.plan = seconds_since(planning);
  if (options.explain && first) fmt::print("{}", simulation.explanation(*registry));
  const std::filesystem::path folder = options.output.empty() ? std::filesystem::path("out") / scene.file.stem() : options.output;
  set_up_alone.reset();
  RunRecorder recorder(simulation, folder, !options.quiet, options.resume ? RunStart::resume : RunStart::fresh,
                       library_fingerprints(*registry), options.force);
  recorder.log(fmt::format("perikit {}: {}\n{}", version(), scene.file.string(), summary));
  if (options.resume) {
    const std::string from = recorder.resumed_step() >= 0 ? fmt::format("resumed after step {}, time {:.6g} s",
                                                                        recorder.resumed_step(), simulation.problem().state().time)
                                                          : "no checkpoint to resume from: the run starts from its initial state";
    recorder.log(from);
    if (!options.quiet && first) fmt::print("{}\n", from);
  }
  if (communicator().size() > 1)
    if (const std::string warning = crowded(thread_count()); !warning.empty()) recorder.log(warning);
  recorder.log(simulation.explanation(*registry));
  for (const RefusedLibrary& refused : registry->refused())
    recorder.log(named("libraries", fmt::format("warning: refused {}: {}", refused.file.string(), refused.reason)));
  try {
    simulation.run(recorder);
    recorder.finish();
  } catch (const RunError& error) {
    const std::string reason = fmt::format("{}; last good frame: {}", error.what(),
                                           recorder.frames() > 0 ? fmt::format("{}", recorder.frames() - 1) : "none");
    log_end(recorder, fmt::format("failed: {}", reason));
    throw RunError(reason);
  }
  const std::string closing = recorder.closing(before);
  log_end(recorder, closing);
  if (!options.quiet && first)
    fmt::print("{}\nskipped       what the scene does not need: --explain, or {}\n", closing, (folder / "run.log").string());
  if (recorder.cancelled()) {
    const std::string stopped = fmt::format(
        "stopped by a signal after step {}, time {:.6g} s; frame {} and a checkpoint were kept: go on with --resume -o {}",
        simulation.problem().state().step, simulation.problem().state().time, recorder.frames() - 1, folder.string());
    log_end(recorder, stopped);
    throw RunError(stopped);
  }
}

/// The time of a force evaluation on this machine, with all arrays in place and every point in motion, none left out.
std::string time_of_forces(Simulation& simulation) {
  BodyProblem& problem = simulation.problem();
  Field force = problem.make_field(), u = problem.make_field();
  for (const std::int32_t p : problem.points().owned())
    for (int a = 0; a < problem.dimension(); ++a) u.component(a)[p] = 1e-9 * problem.points().spacing() * static_cast<double>((p + a) % 7 - 3);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const auto start = std::chrono::steady_clock::now();
    if (!problem.evaluate_forces({u, 0}, force, nullptr).ok()) return {};
    least = std::min(least, seconds_since(start));
  }
  return fmt::format("time          about {:.3g} ms a force evaluation, with {} thread{}\n", 1e3 * least, thread_count(), thread_count() > 1 ? "s" : "");
}

void check(const Options& options) {
  const NothingToKeep nothing;
  const auto registry = open_registry(options);
  if (options.machine) {
    if (!options.machine_values.empty()) return store_machine_values(*registry, options.machine_values);
    fmt::print("{}\n", check_machine(*registry, data_folder() / "machine_values.csv"));
    return;
  }
  if (options.scene.empty()) throw InputError("check: found no scene; allowed: a scene file, or --machine");
  const Scene scene = read(options, *registry);
  std::string summary;
  if (options.ranks > 1 && !one_rank_holds(scene)) {
    summary = predict_ranks(scene, *registry, options.ranks, true);
  } else {
    {  // whose memory the parts of ranks need
      const PeakMemory peak;
      Simulation simulation(scene, *registry);
      summary = simulation.overview() + simulation.summary();  // which may still refuse
      if (options.explain) summary += simulation.explanation(*registry);
      try_step(simulation);
      summary += time_of_forces(simulation);
      const double bytes = peak.bytes();
      if (const double solver = simulation.refuse_memory(); bytes > 0)
        summary += fmt::format("process       about {:.3g} MB at most{}\n", (bytes + solver) / 1e6,
                               solver > 0 ? fmt::format(", {:.3g} MB of them in the solver of {}", solver / 1e6, scene.integrator->type) : "");
      if (!options.output.empty()) plot_overview(simulation, options.output);   // whose memory is not that of a run
    }
    if (options.ranks > 1) summary += predict_ranks(scene, *registry, options.ranks, false);
  }
  fmt::print("{}\n", scene.resolved);
  // The summary as comments: what is printed is itself a scene.
  std::istringstream lines(fmt::format("perikit       {}\n{}", version(), summary));
  for (std::string line; std::getline(lines, line);) fmt::print("# {}\n", line);
}

void study(const Options& options) {
  const auto registry = open_registry(options);
  // Runs side by side share the cores.
  if (const int threads = options.threads > 0 ? options.threads : std::max(1, thread_count() / options.jobs);
      threads != thread_count())
    set_thread_count(threads);
  const Study study = read_study(options.scene, *registry);
  const std::filesystem::path folder = options.output.empty() ? std::filesystem::path("out") / study.file.stem() : options.output;
  const auto runner = [&](const Scene& scene, const std::filesystem::path& own) {
    return run_in_child(scene, *registry, own, options.force);
  };
  const auto progress = [&](const std::string& line) {
    if (options.quiet) return;
    std::puts(line.c_str());  // a line that cannot be written ends no study
    std::fflush(stdout);
  };
  const StudyTable table = run_study(study, *registry, {options.overrides, options.trust}, folder, runner, progress,
                                     {options.jobs, options.resume, options.force});
  const auto done = std::ranges::count(table.rows, "done", &StudyRow::status);
  if (!options.quiet)
    fmt::print("\n{}\n{} of {} runs done; table{} in {}\n", table.markdown(), done, table.rows.size(),
               study.plot ? " and plot" : "", folder.string());
  if (done == 0) throw RunError(fmt::format("no run of the study came to its end; the first: {}", table.rows.front().reason));
  const std::string unfinished = unfinished_runs(table);
  if (unfinished.empty()) return;
  if (!options.keep_going) throw RunError(unfinished + "\n--keep-going ends such a study with status 0");
  tell(unfinished + '\n');   // with --quiet, too: who reads the table alone would not see it
}

void list(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", list_parts(*registry, options.kind));
}

void describe(const Options& options) {
  const auto registry = open_registry(options);
  if (!options.markdown && options.part.empty())
    throw InputError("name what to describe: KIND/NAME, scene, scene/SECTION or study; --markdown describes everything");
  if (options.markdown && !options.part.empty()) throw InputError("--markdown describes everything: name no part");
  fmt::print("{}", options.markdown ? reference_page(*registry) : describe_part(*registry, options.part));
}

void plot(const Options& options) {
  PlotOptions plot_options = options.plot;
  if (options.frame >= 0) plot_options.frame = options.frame;
  if (!options.unit.empty()) plot_options.unit = options.unit;
  if (options.view.size() == 3) plot_options.view = {options.view[0], options.view[1], options.view[2]};
  if (options.range.size() == 2) plot_options.range = {{options.range[0], options.range[1]}};
  if (options.window.size() == 4) plot_options.window = {{options.window[0], options.window[1], options.window[2], options.window[3]}};
  plot_options.output = options.output;
  fmt::print("{}\n", perikit::plot(plot_options).string());
}

void bench(const Options& options) {
  const auto registry = open_registry(options);
  set_thread_count(options.bench.threads);
  bench(*registry, options.bench);
}

void start_project(const Options& options) {
  const auto registry = open_registry(options);
  fmt::print("{}", new_project(*registry, options.kind, options.part, options.history));
}

}  // namespace perikit::app
