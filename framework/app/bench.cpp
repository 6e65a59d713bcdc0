#include "bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "perikit/core/parallel.hpp"
#include "perikit/output/machine_limits.hpp"
#include "perikit/run/simulation.hpp"

namespace perikit::app {

namespace {

/// Runs without output; times the steps after the first ones, which touch memory for the first time.
class StepTimer final : public Observer {
 public:
  bool wants_sample(std::int64_t, double) override { return false; }
  void step_done(const StepReport& report) override {
    const auto now = std::chrono::steady_clock::now();
    if (report.step > 2) best_ = std::min(best_, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  void log(std::string_view) override {}
  /// The fastest step: other programs on the machine can only slow a step down [s].
  double best() const noexcept { return best_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double best_ = INFINITY;
};

std::string scene_of(const std::string& kinematics, const std::string& table, int dimension, int cells, bool cloud, int steps) {
  const auto vector = [&](double value) {
    std::string text = "[";
    for (int a = 0; a < dimension; ++a) text += fmt::format("{}{}", a > 0 ? ", " : "", value);
    return text + "]";
  };
  const auto words = [&](const std::string& first) {
    std::string text = "[\"" + first + "\"";
    for (int a = 1; a < dimension; ++a) text += ", \"0\"";
    return text + "]";
  };
  return fmt::format(
      "format = 1\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = 1.0\nlower = {}\nupper = {}\n{}"
      "[family]\nhorizon_ratio = 3.015\n[kinematics]\ntype = \"{}\"\n{}\n"
      "[material]\ntype = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio = 0.25\n"
      "[initial]\ndisplacement = {}\nvelocity = {}\n[integrator]\ntype = \"verlet\"\ntime_step = 0.01\nend_time = {}\n",
      dimension, dimension == 2 ? "plane = \"strain\"\n" : "", vector(0.0), vector(cells), cloud ? "jitter = 0.2\n" : "", kinematics, table,
      words("1e-3 * sin(x)"), words("1e-3 * cos(x)"), 0.01 * steps);
}

/// Seconds per point and step, and bytes per point.
std::pair<double, double> time_step_of(Registry& registry, const std::string& kinematics, const std::string& table, int dimension, int cells, bool cloud) {
  const auto timed = [&](int steps, double& bytes) {
    const Scene scene = parse_scene(scene_of(kinematics, table, dimension, cells, cloud, steps), "bench.toml", registry);
    Simulation simulation(scene, registry);
    StepTimer timer;
    simulation.run(timer);
    const auto points = static_cast<double>(simulation.problem().points());
    bytes = static_cast<double>(simulation.problem().bytes()) / points;
    return timer.best() / points;
  };
  double bytes = 0;
  const double points = std::pow(cells, dimension), probe = timed(4, bytes);
  const int steps = std::clamp(static_cast<int>(1.5 / (probe * points)), 4, 200);
  return {std::min(probe, timed(steps, bytes)), bytes};
}

/// Every kinematics, and `conventional` with every stabilization.
std::vector<std::string> every_row(const Registry& registry) {
  std::vector<std::string> rows = registry.names(Kind::kinematics);
  for (const std::string& stabilization : registry.names(Kind::stabilization)) rows.push_back("conventional+" + stabilization);
  return rows;
}

}  // namespace

void bench(Registry& registry, const std::vector<std::string>& kinematics, int dimension, int cells) {
  const MachineLimits limits = measure_machine_limits();
  fmt::print("machine: triad {:.1f} GB/s, multiply-add {:.1f} GFLOP/s, gather of 32-byte rows {:.1f} GB/s (one thread); {} threads: {:.1f}, {:.1f}, {:.1f}\n\n",
             limits.triad_one, limits.multiply_add_one, limits.gather_one, limits.threads, limits.triad_all, limits.multiply_add_all, limits.gather_all);
  fmt::print("{}D, {} points a side, horizon 3.015 spacings, saint_venant_kirchhoff, verlet, {} thread(s); fastest step\n\n", dimension, cells, thread_count());
  fmt::print("| kinematics | lattice: ns a point and step | bytes a point | cloud: ns a point and step | bytes a point |\n|---|---|---|---|---|\n");
  for (const std::string& name : kinematics.empty() ? every_row(registry) : kinematics) {
    const std::size_t plus = name.find('+');
    const std::string part = name.substr(0, plus), example = registry.describe(Kind::kinematics, part).examples.front();
    const std::string table = plus == name.npos ? example : fmt::format("{}\nstabilization = \"{}\"", example, name.substr(plus + 1));
    const auto [lattice, lattice_bytes] = time_step_of(registry, part, table, dimension, cells, false);
    const auto [cloud, cloud_bytes] = time_step_of(registry, part, table, dimension, cells, true);
    fmt::print("| {} | {:.1f} | {:.0f} | {:.1f} | {:.0f} |\n", name, lattice * 1e9, lattice_bytes, cloud * 1e9, cloud_bytes);
    std::fflush(stdout);
  }
}

}  // namespace perikit::app
