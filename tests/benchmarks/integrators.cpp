/// ninja integrators_benchmark: where the time of quasi-static integrators goes. Cook's membrane at L/40 and L/120, matrix-free a
/// 3D block of 31^3 points. Processor seconds of one thread, so that a busy machine changes little. A Markdown table and a JSON
/// file.
///   integrators_benchmark [--small] [JSON]

#include <fmt/format.h>

#include <cstring>
#include <ctime>
#include <fstream>

#include "perikit/core/parallel.hpp"
#include "plugin/registry.hpp"
#include "run/simulation.hpp"
#include "tests/benchmarks/timed_problem.hpp"
#include "tests/kit/observers.hpp"

using namespace perikit;
using namespace perikit::benchmarks;

namespace {

class Counter final : public test::Silent {
 public:
  void step_done(const StepReport& report) override {
    iterations += report.iterations;
    reached = report.time;
  }
  void log(std::string_view text) override { (log_ += text) += '\n'; }
  /// Iterations of GMRES; 0 where there are none.
  long krylov() const {
    long sum = 0;
    for (std::size_t at = log_.find("gmres "); at != log_.npos; at = log_.find("gmres ", at + 1))
      sum += std::strtol(&log_[at + 6], nullptr, 10);
    for (std::size_t at = log_.find("iterations, "); at != log_.npos; at = log_.find("iterations, ", at + 1))
      sum += std::strtol(&log_[at + 12], nullptr, 10);
    return sum;
  }
  int iterations = 0;
  double reached = 0;

 private:
  std::string log_;
};

struct Job {
  std::string body, scene, integrator, name;
  std::vector<std::string> overrides;
};

struct Row {
  std::size_t points = 0;
  double seconds = 0, rest = 0;
  Share forces, actions, assemblies, companions;
  int iterations = 0;
  long krylov = 0;
  std::string end;
};

Row measure(Registry& registry, const Job& job, double most) {
  Row row;
  std::vector<std::string> overrides = job.overrides;
  overrides.push_back("integrator=" + job.integrator);
  const Scene scene = read_scene(job.scene, registry, {.overrides = std::move(overrides)});
  Simulation simulation(scene, registry);
  TimedProblem problem(simulation.problem(), most);
  Counter counter;
  const std::clock_t start = std::clock();
  try {
    simulation.integrator().run(problem, counter);
    row.end = "done";
  } catch (const RunError& error) {
    row.end = problem.late() ? fmt::format("{:g} s at t = {:.2g}", most, counter.reached) : "failed";
    if (!problem.late()) fmt::print(stderr, "{}, {}: {}\n", job.body, job.name, error.what());
  }
  row.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  row.points = problem.body().points();
  row.forces = problem.forces;
  row.actions = problem.actions;
  row.assemblies = problem.assemblies;
  row.companions = problem.companions;
  row.rest = row.seconds - row.forces.seconds - row.actions.seconds - row.assemblies.seconds - row.companions.seconds;
  row.iterations = counter.iterations;
  row.krylov = counter.krylov();
  return row;
}

std::vector<Job> jobs(bool small) {
  const std::string folder = PERIKIT_SOURCE_FOLDER "/configs/", cook = folder + "scabbia/cook.toml",
                    block = folder + "work_precision/block.toml";
  const std::string steps = "steps = 5, tolerance = 1e-8";
  std::vector<Job> all;
  for (const double parts : small ? std::vector<double>{10} : std::vector<double>{40, 120}) {
    for (const std::string name : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
      const std::string more = name == "dynamic_relaxation" ? ", max_iterations = 10000000" : "";
      all.push_back({fmt::format("Cook L/{:g}", parts),
                     cook,
                     fmt::format("{{ type = \"{}\", {}{} }}", name, steps, more),
                     name,
                     {fmt::format("constants.h={:.17g}", 44 / parts)}});
    }
  }
  for (const std::string kinematics : {"baqp", "conventional + silling"}) {
    const std::string table = kinematics == "baqp" ? "kinematics={ type = \"baqp\" }"
                                                   : "kinematics={ type = \"conventional\", stabilization = \"silling\" }";
    const std::string body = fmt::format("block {}^3, {}", small ? 7 : 31, kinematics),
                      points = fmt::format("constants.n={}", small ? 7 : 31);
    const auto add = [&](const std::string& name, const std::string& type, const std::string& more) {
      all.push_back(
          {body, block, fmt::format("{{ type = \"{}\", steps = 1, tolerance = 1e-8{} }}", type, more), name, {points, table}});
    };
    add("jfnk", "jfnk", "");
    add("jfnk, no preconditioner", "jfnk", ", preconditioner = \"none\"");
    add("kinsol", "kinsol", "");
    add("dynamic_relaxation", "dynamic_relaxation", "");
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  bool small = false;
  const char* json = nullptr;
  for (int k = 1; k < argc; ++k) (std::strcmp(argv[k], "--small") == 0) ? void(small = true) : void(json = argv[k]);
  set_thread_count(1);
  Registry registry;
  registry.add_folder(PERIKIT_PLUGIN_FOLDER);
  std::string rows;
  bool failed = false;
  fmt::print(
      "Processor seconds, one thread. Rest: factorisation and triangular solves of newton; preconditioner and Krylov vectors of "
      "jfnk and kinsol; vectors of\n"
      "dynamic_relaxation. In brackets: calls.\n\n| body | points | integrator | all | forces | tangent actions | assembly | "
      "companion | rest | iterations | Krylov iterations | end |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Job& job : jobs(small)) {
    const Row row = measure(registry, job, 90);
    const auto cell = [](const Share& share) {
      return share.calls == 0 ? std::string("-") : fmt::format("{:.2f} ({})", share.seconds, share.calls);
    };
    fmt::print("| {} | {} | {} | {:.2f} | {} | {} | {} | {} | {:.2f} | {} | {} | {} |\n", job.body, row.points, job.name,
               row.seconds, cell(row.forces), cell(row.actions), cell(row.assemblies), cell(row.companions), row.rest,
               row.iterations, row.krylov > 0 ? fmt::format("{}", row.krylov) : "-", row.end);
    std::fflush(stdout);
    rows += fmt::format(
        "{}\n  {{\"body\": \"{}\", \"points\": {}, \"integrator\": \"{}\", \"seconds\": {:.4g}, \"forces_s\": {:.4g}, "
        "\"forces\": {}, \"tangent_actions_s\": {:.4g}, "
        "\"tangent_actions\": {}, \"assembly_s\": {:.4g}, \"assemblies\": {}, \"companion_s\": {:.4g}, \"companions\": {}, "
        "\"rest_s\": {:.4g}, \"iterations\": {}, "
        "\"krylov_iterations\": {}, \"end\": \"{}\"}}",
        rows.empty() ? "" : ",", job.body, row.points, job.name, row.seconds, row.forces.seconds, row.forces.calls,
        row.actions.seconds, row.actions.calls, row.assemblies.seconds, row.assemblies.calls, row.companions.seconds,
        row.companions.calls, row.rest, row.iterations, row.krylov, row.end);
    failed = failed || row.end == "failed";
  }
  if (json) {
    std::ofstream file(json);
    file << "[" << rows << "\n]\n";
    if (!file.flush()) {
      fmt::print(stderr, "{}: cannot be written\n", json);
      return 1;
    }
  }
  return small && failed ? 1 : 0;
}
