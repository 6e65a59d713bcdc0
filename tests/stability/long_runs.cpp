#include <fmt/format.h>

#include <cmath>

#include "perikit/problem/motion.hpp"
#include "perikit/sdk/stable_step.hpp"
#include "tests/kit/observers.hpp"
#include "tests/stability/measures.hpp"

namespace perikit::stability {

namespace {

/// The total energy of every so many steps, and the sign changes of the displacement of one point.
class EnergyWatcher final : public test::Silent {
 public:
  EnergyWatcher(BodyProblem& problem, std::int64_t every)
      : problem_(problem), every_(every), end_(problem.body().internal().back()) {}
  bool wants_sample(std::int64_t step, double) override { return step % every_ == 0; }
  void step_done(const StepReport& report) override {
    if (report.step % every_ != 0) return;
    energies_.push_back(problem_.state().energies.strain + kinetic_energy(problem_, problem_.state().velocity()));
    const double u = problem_.state().displacement().component(0)[end_];
    signs_ += u * last_ < 0;
    last_ = u;
  }

  std::int64_t signs() const { return signs_; }
  Drift drift() const {
    const auto tenth = static_cast<std::ptrdiff_t>(energies_.size() / 10);
    const auto mean = [&](auto begin) {
      double sum = 0;
      for (auto e = begin; e != begin + tenth; ++e) sum += *e;
      return sum / static_cast<double>(tenth);
    };
    const double start = mean(energies_.begin());
    Drift result;
    for (const double energy : energies_)
      result.largest_deviation = std::max(result.largest_deviation, std::abs(energy / start - 1));
    result.drift = mean(energies_.end() - tenth) / start - 1;
    return result;
  }

 private:
  BodyProblem& problem_;
  std::int64_t every_;
  std::int32_t end_;
  std::vector<double> energies_;
  std::int64_t signs_ = 0;
  double last_ = 0;
};

}  // namespace

std::vector<Setting> long_settings(Registry& registry) {
  std::vector<Setting> some;
  for (Setting s : all_settings(registry)) {
    if (s.influence != "gaussian" || s.horizon_ratio != 3.015 || (s.jitter != 0.0 && s.jitter != 0.3)) continue;
    s.side = s.dimension == 1 ? 40 : s.dimension == 2 ? 7 : 4;
    some.push_back(s);
  }
  return some;
}

Drift Specimen::endure(double largest, double share, std::int64_t steps) const {
  const auto simulation = shaken(largest, share, steps);
  // At full steps the energy of a mode near the limit swings with twice its frequency: left out steps would let it beat slowly.
  EnergyWatcher watcher(simulation->problem(), 1);
  simulation->run(watcher);
  return watcher.drift();
}

Vibration vibrate(Registry& registry, const std::string& kinematics, std::int64_t steps) {
  // Steps at 0.9 of the stable one; their number, not the end time, is what is asked for.
  const auto scene = [&](const std::string& integrator) {
    return fmt::format(
        "format = 1\n[body]\ndimension = 1\nline = \"strain\"\n[body.lattice]\nspacing = 1.0\nlower = [0]\nupper = "
        "[40]\n[sets]\nend = "
        "\"x < 1\"\n[family]\nhorizon_ratio = 3.015\ninfluence = \"gaussian\"\n"
        "[kinematics]\ntype = \"{}\"\n{}\n[material]\ntype = \"neo_hookean\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio "
        "= 0.25\n"
        "[initial]\ndisplacement = [\"0.25 * sin(pi * (x - 0.5) / 80)\"]\n[[boundary]]\nset = \"end\"\ndisplacement = "
        "[0]\n[run]\nthreads = "
        "1\n[integrator]\n{}\n",
        kinematics, registry.describe(Kind::kinematics, kinematics).examples.front(), integrator);
  };
  const auto build = [&](const std::string& integrator) {
    return std::make_unique<Simulation>(parse_scene(scene(integrator), "vibration.toml", registry), registry);
  };
  const auto first = build("type = \"verlet\"\nend_time = 1.0");
  const double step = 0.9 * 2 / std::sqrt(largest_eigenvalue(first->problem(), first->problem().state().displacement()));
  const auto simulation =
      build(fmt::format("type = \"verlet\"\nend_time = {:.17g}\ntime_step = {:.17g}", static_cast<double>(steps) * step, step));

  EnergyWatcher watcher(simulation->problem(), 10);
  simulation->run(watcher);
  return {watcher.drift(), 0.5 * static_cast<double>(watcher.signs())};
}

}  // namespace perikit::stability
