#include "bench.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>

#include "core/threads/loop_times.hpp"
#include "data_folder.hpp"
#include "operations.hpp"
#include "output/machine_limits.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"
#include "run/simulation.hpp"

namespace perikit::app {

namespace {

/// Runs without output; times the steps after the first ones, which touch memory for the first time.
class StepTimer final : public Observer {
 public:
  bool wants_sample(std::int64_t, double) override { return false; }
  void step_done(const StepReport& report) override {
    operations_ = counted_operations() - counted_;
    counted_ += operations_;
    const auto now = std::chrono::steady_clock::now();
    if (report.step > 2) best_ = std::min(best_, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  void log(std::string_view) override {}
  /// The fastest step: other programs on the machine can only slow a step down [s].
  double best() const noexcept { return best_; }
  /// Of the last step, where they are counted.
  std::uint64_t operations() const noexcept { return operations_; }

 private:
  std::uint64_t counted_ = 0, operations_ = 0;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double best_ = INFINITY;
};

constexpr int modelled_threads[] = {2, 4, 8, 16, 32, 64};

/// What a step would take on more threads: loops as long as their last thread, all else as on one. Each index of a loop takes what it took in the step
/// where it was fastest: what interrupts it for a moment would be a whole share of a short loop.
class ThreadsModel final : public Observer {
 public:
  bool wants_sample(std::int64_t, double) override { return false; }
  void step_done(const StepReport& report) override {
    const std::vector<TimedLoop> loops = times_.take();
    const auto now = std::chrono::steady_clock::now();
    if (report.step > 2) {
      double inside = 0;
      for (const TimedLoop& loop : loops) inside += makespan(loop, 1);
      outside_ = std::min(outside_, std::max(0.0, std::chrono::duration<double>(now - last_).count() - inside));
      if (loops_.empty()) loops_ = loops;
      for (std::size_t l = 0; l < std::min(loops_.size(), loops.size()); ++l)
        for (std::size_t i = 0; i < std::min(loops_[l].seconds.size(), loops[l].seconds.size()); ++i)
          loops_[l].seconds[i] = std::min(loops_[l].seconds[i], loops[l].seconds[i]);
    }
    last_ = std::chrono::steady_clock::now();
  }
  void log(std::string_view) override {}
  void print() const {
    const double one = seconds(1);
    std::size_t blocks = 0;
    for (const TimedLoop& loop : loops_) blocks += loop.seconds.size();
    fmt::print("{} | {} | {:.1f} |", loops_.size(), blocks, 100 * outside_ / one);
    for (const int threads : modelled_threads) fmt::print(" {:.0f} |", 100 * one / (threads * seconds(threads)));
    fmt::print("\n");
  }

 private:
  double seconds(int threads) const {
    double total = outside_;
    for (const TimedLoop& loop : loops_) total += makespan(loop, threads);
    return total;
  }

  LoopTimes times_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::vector<TimedLoop> loops_;
  double outside_ = INFINITY;
};

/// One row: a kinematics with a material on one body. Times in seconds per point, not a number where not measured.
struct Row {
  std::string kinematics, material;
  int dimension = 3;
  std::string lateral = "strain";   ///< what is zero across planes and lines: "strain", "stress"
  bool cloud = false;
  std::size_t points = 0;
  double step = INFINITY, bytes = 0, set_up = INFINITY, tangent = INFINITY, assembly = NAN, operations = NAN;
};

/// "32", or "10 x 10 x 80" where sides differ.
std::string sides(const std::vector<int>& cells) { return fmt::format("{}", fmt::join(cells, " x ")); }

std::string scene_of(const Row& row, const std::string& kinematics, const std::string& material, const std::vector<int>& cells, int steps) {
  const int dimension = row.dimension;
  const auto vector = [&](const std::vector<int>& of) {
    std::string text = "[";
    for (int a = 0; a < dimension; ++a) text += fmt::format("{}{}", a > 0 ? ", " : "", of[std::min(static_cast<std::size_t>(a), of.size() - 1)]);
    return text + "]";
  };
  const auto words = [&](const std::string& first) {
    std::string text = "[\"" + first + "\"";
    for (int a = 1; a < dimension; ++a) text += ", \"0\"";
    return text + "]";
  };
  return fmt::format(
      "format = 1\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = 1.0\nlower = {}\nupper = {}\n{}"
      "[family]\nhorizon_ratio = 3.015\n{}[kinematics]\n{}\n[material]\n{}\n"
      "[initial]\ndisplacement = {}\nvelocity = {}\n[integrator]\ntype = \"verlet\"\ntime_step = 1e-4\nend_time = {}\n",
      dimension,
      dimension == 3 ? "" : fmt::format("{} = \"{}\"\n", dimension == 2 ? "plane" : "line", row.lateral),
      vector({0}), vector(cells), row.cloud ? "jitter = 0.2\n" : "",
      row.cloud ? "consistent = false\n" : "",  // set-up is the search of families
      kinematics, material, words("1e-3 * sin(x)"), words("1e-3 * cos(x)"), 1e-4 * steps);
}

/// Seconds that `work` takes, the fastest of a few times.
template <class Work>
double fastest(Work&& work) {
  double best = INFINITY, total = 0;
  for (int run = 0; run < 10 && (run == 0 || total < 1.0); ++run) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    best = std::min(best, seconds);
    total += seconds;
  }
  return best;
}

void measure(Registry& registry, Row& row, const std::string& kinematics, const std::string& material, const BenchOptions& options) {
  const auto timed = [&](int steps, bool all) {
    const Scene scene = parse_scene(scene_of(row, kinematics, material, options.cells, steps), "bench.toml", registry);
    const auto start = std::chrono::steady_clock::now();
    Simulation simulation(scene, registry);
    row.set_up = std::min(row.set_up, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    Problem& problem = simulation.problem();
    StepTimer timer;
    simulation.run(timer);
    row.points = problem.points().size();
    const auto points = static_cast<double>(row.points);
    row.bytes = static_cast<double>(simulation.problem().bytes()) / points;
    row.step = std::min(row.step, timer.best() / points);
    if (counts_operations) row.operations = static_cast<double>(timer.operations()) / points;
    if (!all) return;
    row.set_up /= points;
    Field w = problem.points().make_field(row.dimension), Kw = problem.points().make_field(row.dimension);
    std::copy_n(problem.state().displacement().data, w.components() * w.stride(), w.data());
    const auto check = [](const EvaluationStatus& status) {
      if (!status.ok()) throw RunError(fmt::format("bench: {}", status.description));
    };
    row.tangent = fastest([&] { check(problem.tangent_action({problem.state().displacement(), 0}, w, Kw)); }) / points;
    if (!options.assembly) return;
    BlockMatrix K;
    check(problem.assemble_tangent({problem.state().displacement(), 0}, K));   // with the pattern, which later ones keep
    row.assembly = fastest([&] { check(problem.assemble_tangent({problem.state().displacement(), 0}, K)); }) / points;
  };
  timed(4, false);
  if (counts_operations) return;
  timed(std::clamp(static_cast<int>(1.5 / (row.step * static_cast<double>(row.points))), 4, 200), true);
}

/// Every kinematics, and `conventional` with every stabilization.
std::vector<std::string> every_row(const Registry& registry) {
  std::vector<std::string> rows = registry.names(Kind::kinematics);
  for (const std::string& stabilization : registry.names(Kind::stabilization)) rows.push_back("conventional+" + stabilization);
  return rows;
}

/// "12.3 (45 %)": a rate and its share of the limit.
std::string rate(double value, double limit) {
  return std::isfinite(value) ? fmt::format("{:.1f} ({:.0f} %)", value, 100 * value / limit) : std::string("-");
}

/// What a step reads and writes at least, every byte of a point once [GB/s], and what it computes [GFLOP/s].
double traffic(const Row& row) { return 1e-9 * row.bytes / row.step; }
double arithmetic(const Row& row) { return 1e-9 * row.operations / row.step; }

std::string json_of(const MachineLimits& limits, const std::vector<Row>& rows) {
  const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string("null"); };
  std::string text = fmt::format(
      "{{\n  \"threads\": {},\n  \"triad_GB_per_s\": {},\n  \"multiply_add_GFLOP_per_s\": {},\n  \"gather_GB_per_s\": {},\n  \"rows\": [",
      limits.threads, number(limits.triad_all), number(limits.multiply_add_all), number(limits.gather_all));
  for (const Row& row : rows)
    text += fmt::format(
        "{}\n    {{\"kinematics\": \"{}\", \"material\": \"{}\", \"dimension\": {}, \"body\": \"{}\", \"points\": {}, \"lateral\": {}, \"step_ns\": {}, "
        "\"bytes\": {}, \"operations\": {}, \"of_triad\": {}, \"of_multiply_add\": {}, \"set_up_ns\": {}, \"tangent_action_ns\": {}, \"assembly_ns\": {}}}",
        &row == rows.data() ? "" : ",", row.kinematics, row.material, row.dimension, row.cloud ? "cloud" : "lattice", row.points,
        row.dimension == 3 ? "null" : fmt::format("\"{}\"", row.lateral), number(1e9 * row.step),
        number(row.bytes), number(row.operations), number(traffic(row) / limits.triad_all), number(arithmetic(row) / limits.multiply_add_all),
        number(1e9 * row.set_up), number(1e9 * row.tangent), number(1e9 * row.assembly));
  return text + "\n  ]\n}\n";
}

/// Dimensions, with what is zero across planes and lines.
std::vector<std::pair<int, std::string>> spaces(const BenchOptions& options) {
  std::vector<std::pair<int, std::string>> all;
  for (const int dimension : options.dimensions) {
    if (dimension == 3) all.emplace_back(dimension, "strain");
    else for (const std::string& lateral : options.lateral) all.emplace_back(dimension, lateral);
  }
  return all;
}

/// "2", or "2 stress" in plane stress.
std::string space_of(const Row& row) { return fmt::format("{}{}", row.dimension, row.lateral == "stress" ? " stress" : ""); }

/// work(row, [kinematics], [material]) for every row that the options ask for; what it prints is shown as soon as it is there.
template <class Work>
std::vector<Row> for_each_row(Registry& registry, const BenchOptions& options, Work&& work) {
  std::vector<Row> rows;
  for (const std::string& name : options.kinematics.empty() ? every_row(registry) : options.kinematics)
    for (const std::string& material : options.materials)
      for (const auto& [dimension, lateral] : spaces(options))
        for (const bool cloud : {false, true}) {
          const std::size_t plus = name.find('+');
          const std::string part = name.substr(0, plus), example = registry.describe(Kind::kinematics, part).examples.front();
          const std::string stabilization = plus == name.npos ? "" : fmt::format("\nstabilization = \"{}\"", name.substr(plus + 1));
          work(rows.emplace_back(Row{name, material, dimension, lateral, cloud}), fmt::format("type = \"{}\"\n{}{}", part, example, stabilization),
               fmt::format("type = \"{}\"\n{}", material, registry.describe(Kind::material, material).examples.front()));
          std::fflush(stdout);
        }
  return rows;
}

void print_head(const Row& row) {
  fmt::print("| {} | {} | {} | {} | ", row.kinematics, row.material, space_of(row), row.cloud ? "cloud" : "lattice");
}

void model_threads(Registry& registry, Row& row, const std::string& kinematics, const std::string& material, const BenchOptions& options) {
  const Scene scene = parse_scene(scene_of(row, kinematics, material, options.cells, 12), "bench.toml", registry);
  Simulation simulation(scene, registry);
  row.points = simulation.problem().points().size();
  ThreadsModel model;
  simulation.run(model);
  print_head(row);
  fmt::print("{} | ", row.points);
  model.print();
}

std::string key_of(const Row& row, const BenchOptions& options) {
  return Operations::key(row.kinematics, row.material, space_of(row), row.cloud, sides(options.cells));
}

void count(Registry& registry, const BenchOptions& options) {
  fmt::print("{} points a side, horizon 3.015 spacings, verlet. Floating-point operations of a step.\n\n"
             "| kinematics | material | D | body | operations a point |\n|---|---|---|---|---|\n", sides(options.cells));
  Operations operations;
  for_each_row(registry, options, [&](Row& row, const std::string& kinematics, const std::string& material) {
    measure(registry, row, kinematics, material, options);
    print_head(row);
    fmt::print("{:.0f} |\n", row.operations);
    operations.set(key_of(row, options), row.operations);
  });
  if (!options.operations.empty()) operations.write(options.operations);
}

}  // namespace

void bench(Registry& registry, const BenchOptions& options) {
  // Nothing is lost where a signal ends it.
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  if constexpr (counts_operations) return count(registry, options);
  if (options.threads_model) {
    fmt::print("{} points a side, horizon 3.015 spacings, verlet. Efficiency of a step [%] on more threads, from the seconds of the blocks of its loops on\n"
               "one thread; starting a loop and waiting at its end cost nothing here, memory is as fast as for one thread. Outside: of loops.\n\n"
               "| kinematics | material | D | body | points | loops | blocks | outside [%] |", sides(options.cells));
    for (const int threads : modelled_threads) fmt::print(" {} |", threads);
    fmt::print("\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for_each_row(registry, options, [&](Row& row, const std::string& kinematics, const std::string& material) {
      model_threads(registry, row, kinematics, material, options);
    });
    return;
  }
  const Operations operations(options.operations.empty() ? data_folder() / "operations.csv" : std::filesystem::path(options.operations));
  std::ofstream file;
  const auto refuse = [&] { throw RunError(fmt::format("{}: cannot be written", options.json)); };
  if (!options.json.empty() && (file.open(options.json), !file)) refuse();   // before minutes of measuring, not after
  const MachineLimits limits = measure_machine_limits();
  fmt::print("machine: triad {:.1f} GB/s, multiply-add {:.1f} GFLOP/s, gather of 32-byte rows {:.1f} GB/s (one thread); {} threads: {:.1f}, {:.1f}, {:.1f}\n\n",
             limits.triad_one, limits.multiply_add_one, limits.gather_one, limits.threads, limits.triad_all, limits.multiply_add_all, limits.gather_all);
  fmt::print("{} points a side, horizon 3.015 spacings, verlet, {} thread(s). ns a point: of the fastest step; of the set-up, the tangent action and the\n"
             "assembly of the tangent. Traffic: the bytes of a point, once a step, in GB/s and of the triad. Arithmetic: the operations of a step (-: not\n"
             "counted for this row, see --operations), in GFLOP/s and of the multiply-add peak.\n\n", sides(options.cells), thread_count());
  fmt::print("| kinematics | material | D | body | step [ns] | bytes a point | traffic | operations a point | arithmetic | set-up [ns] | tangent action [ns] | assembly [ns] |\n"
             "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const auto whole = [](double value) { return std::isfinite(value) ? fmt::format("{:.0f}", value) : std::string("-"); };
  const std::vector<Row> rows = for_each_row(registry, options, [&](Row& row, const std::string& kinematics, const std::string& material) {
    measure(registry, row, kinematics, material, options);
    print_head(row);
    row.operations = operations.of(key_of(row, options));
    fmt::print("{:.1f} | {:.0f} | {} | {} | {} | {:.0f} | {:.1f} | {} |\n", 1e9 * row.step, row.bytes, rate(traffic(row), limits.triad_all), whole(row.operations),
               rate(arithmetic(row), limits.multiply_add_all), 1e9 * row.set_up, 1e9 * row.tangent, whole(1e9 * row.assembly));
  });
  if (options.json.empty()) return;
  file << json_of(limits, rows);
  if (!file.flush()) refuse();
}

}  // namespace perikit::app
