/// ninja scaling_benchmark: explicit steps, set-up and memory against the number of points, and two threads against one, on 3D
/// lattices. The fastest of many steps counts: other programs on the machine can only slow a step down. Processor time (of all
/// threads together) they change little; two threads cost as much of it as one where they lose nothing, and take half the wall
/// time on two idle cores. A Markdown table and a JSON file.
///   scaling_benchmark [--small] [JSON]

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fstream>

#include "perikit/core/parallel.hpp"
#include "plugin/registry.hpp"
#include "run/simulation.hpp"
#include "tests/kit/observers.hpp"

using namespace perikit;

namespace {

/// The fastest step, by the wall and by the processor (all threads together).
class FastestStep final : public test::Silent {
 public:
  void step_done(const StepReport& report) override {
    const auto time = std::chrono::steady_clock::now();
    const std::clock_t processor_time = std::clock();
    if (report.step > 2) {  // the first ones touch memory
      wall = std::min(wall, std::chrono::duration<double>(time - last_).count());
      processor = std::min(processor, static_cast<double>(processor_time - last_processor_) / CLOCKS_PER_SEC);
    }
    last_ = time;
    last_processor_ = processor_time;
  }
  double wall = INFINITY, processor = INFINITY;

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::clock_t last_processor_ = std::clock();
};

struct Row {
  std::string kinematics;
  int cells = 0, threads = 1;
  std::size_t points = 0;
  double processor = 0, wall = 0, set_up = 0, bytes = 0;  ///< a point
};

Row measure(Registry& registry, const std::string& kinematics, int cells, int threads) {
  set_thread_count(threads);
  Row row{kinematics, cells, threads};
  const auto steps = [&](int count) {
    const std::string text = fmt::format(
        "format = 1\n[body]\ndimension = 3\n[body.lattice]\nspacing = 1.0\nlower = [0, 0, 0]\nupper = [{0}, {0}, "
        "{0}]\n[family]\nhorizon_ratio = 3.015\n"
        "[kinematics]\ntype = \"{1}\"\n[material]\ntype = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = "
        "1.0\npoisson_ratio = 0.25\n"
        "[initial]\ndisplacement = [\"1e-3*sin(x)\", \"0\", \"0\"]\nvelocity = [\"1e-3*cos(x)\", \"0\", \"0\"]\n"
        "[integrator]\ntype = \"verlet\"\ntime_step = 1e-4\nend_time = {2}\n",
        cells, kinematics, 1e-4 * count);
    const Scene scene = parse_scene(text, "scaling.toml", registry);
    const std::clock_t start = std::clock();
    Simulation simulation(scene, registry);
    row.set_up = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    FastestStep fastest;
    simulation.run(fastest);
    row.points = simulation.problem().body().points();
    const auto n = static_cast<double>(row.points);
    row.processor = fastest.processor / n;
    row.wall = fastest.wall / n;
    row.set_up /= n;
    row.bytes = static_cast<double>(simulation.problem().bytes()) / n;
  };
  const double expected = 1e-7 * std::pow(cells, 3);
  steps(std::clamp(static_cast<int>(3 / expected), 10, 1000));
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  bool small = false;
  const char* json = nullptr;
  for (int k = 1; k < argc; ++k) (std::strcmp(argv[k], "--small") == 0) ? void(small = true) : void(json = argv[k]);
  Registry registry;
  registry.add_folder(PERIKIT_PLUGIN_FOLDER);
  std::vector<Row> rows;
  fmt::print(
      "| kinematics | points | threads | step: processor ns a point | wall ns | set-up: ns a point | bytes a point "
      "|\n|---|---|---|---|---|---|---|\n");
  const auto add = [&](const std::string& kinematics, int cells, int threads) {
    const Row& row = rows.emplace_back(measure(registry, kinematics, cells, threads));
    fmt::print("| `{}` | {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n", row.kinematics, row.points, row.threads,
               1e9 * row.processor, 1e9 * row.wall, 1e9 * row.set_up, row.bytes);
    std::fflush(stdout);
  };
  for (const int cells : small ? std::vector<int>{8, 12} : std::vector<int>{22, 32, 46, 68, 100, 159})
    add("conventional", cells, 1);
  add("baqp", small ? 12 : 100, 1);
  for (const char* kinematics : {"conventional", "baqp"})
    for (const int threads : {1, 2}) add(kinematics, small ? 8 : 64, threads);
  bool lean = true;
  for (const Row& row : rows)
    if (row.points >= 1000000) lean = lean && row.bytes < (row.kinematics == "baqp" ? 600 : 400);
  if (json) {
    std::ofstream file(json);
    file << "[";
    for (const Row& row : rows)
      file << fmt::format(
          "{}\n  {{\"kinematics\": \"{}\", \"points\": {}, \"threads\": {}, \"step_processor_ns\": {:.4g}, \"step_wall_ns\": "
          "{:.4g}, \"set_up_ns\": {:.4g}, "
          "\"bytes\": {:.4g}}}",
          &row == rows.data() ? "" : ",", row.kinematics, row.points, row.threads, 1e9 * row.processor, 1e9 * row.wall,
          1e9 * row.set_up, row.bytes);
    file << "\n]\n";
    if (!file.flush()) {
      fmt::print(stderr, "{}: cannot be written\n", json);
      return 1;
    }
  }
  if (!lean) fmt::print(stderr, "more memory than 400 bytes a point (conventional) or 600 (baqp)\n");
  return lean ? 0 : 1;
}
