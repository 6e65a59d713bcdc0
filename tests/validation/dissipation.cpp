/// Laws that dissipate, in whole explicit runs: what was put in is stored, in motion or dissipated, under every kinematics with gradients.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/parallel.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/kit/vector_text.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// A block of the law that `perikit new material --history` writes, let go with a velocity that stretches and shears it.
std::string scene(int dimension, const std::string& kinematics, bool cloud, double safety, const std::string& more = "") {
  static const bool known = (registry().add_folder(PERIKIT_REMEMBERING), true);
  static_cast<void>(known);
  const int cells = dimension == 3 ? 5 : dimension == 2 ? 8 : 40;
  const double width = 0.01 * cells;
  const auto speed = [&](int factor) { return fmt::format("\"{}*(x - {})\"", factor, width / 2); };
  return test::SceneText{.dimension = dimension, .spacing = 0.01, .upper = std::vector<double>(static_cast<std::size_t>(dimension), width),
                         .lattice = fmt::format("jitter = {}", cloud ? 0.2 : 0.0), .family = "horizon_ratio = 2.2", .kinematics = kinematics,
                         .material = "type = \"remembering\"\ndensity = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3\nviscous_modulus = 1.0e6\nrelaxation_time = 2e-3",
                         .further = more + "\n[initial]\nvelocity = " + test::vector_text(dimension, speed(20), speed(10), speed(-5)),
                         .integrator = fmt::format("type = \"verlet\"\nend_time = 6e-3\nsafety = {}", safety)};
}

struct Sum {
  double initial = 0, kinetic = 0, dissipated = 0, missing = 0;
  bool falls = false;   ///< at some step less is dissipated than before
};

Sum sum_of(const std::vector<Energies>& all) {
  Sum sum{.initial = all.front().strain + all.front().kinetic};
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Energies& e = all[k];
    sum.missing = std::max(sum.missing, std::abs(e.strain + e.kinetic + e.dissipated - e.external_work - sum.initial));
    sum.falls |= k > 0 && e.dissipated_by_laws < all[k - 1].dissipated_by_laws;
  }
  sum.kinetic = all.back().kinetic;
  sum.dissipated = all.back().dissipated_by_laws;
  return sum;
}

Sum sum_of(const std::string& text) { return sum_of(contract::run(*build(text)).energies); }

const std::vector<std::string> kinematics{"type = \"conventional\"",
                                          "type = \"conventional\"\norder = 2",
                                          "type = \"baqp\"",
                                          "type = \"projection\"",
                                          "type = \"sub_horizon\"",
                                          "type = \"bond_associated\"",
                                          "type = \"selective\"\nbase = { type = \"baqp\" }"};

}  // namespace

TEST_CASE("laws that dissipate: the energies add up under every kind of kinematics, on lattices and clouds") {
  for (const std::string& each : kinematics)
    for (int d = 1; d <= 3; ++d)
      for (const bool cloud : {false, true}) {
        if (d == 1 && each.find("order") != std::string::npos) continue;
        INFO(fmt::format("{}, {}D, {}", each, d, cloud ? "cloud" : "lattice"));
        // Small bodies swing in their highest modes, so that steps near the stable one miss more. The law is of first order: it takes the
        // implicit Euler rule.
        const Sum sum = sum_of(scene(d, each, cloud, 0.1)), fine = sum_of(scene(d, each, cloud, 0.05));
        CHECK(sum.dissipated > 0.1 * sum.initial);
        CHECK_FALSE(sum.falls);
        CHECK_MESSAGE(sum.missing <= 0.04 * sum.initial, sum.missing, " J of ", sum.initial, " J are missing");
        CHECK_MESSAGE(fine.missing <= 0.6 * sum.missing, "half the step misses ", fine.missing, " J in place of ", sum.missing);
      }
}

TEST_CASE("laws that dissipate: two laws, bonds that fail, any number of threads, and a run that goes on from the middle") {
  const std::string half = "[sets]\nright = \"x > 0.04\"\n[[region]]\nset = \"right\"\nmaterial = { type = \"saint_venant_kirchhoff\", density = 1000.0, "
                           "youngs_modulus = 1.0e6, poisson_ratio = 0.3 }\n";
  for (const std::string& each : kinematics) {
    INFO(each);
    const Sum whole = sum_of(scene(2, each, false, 0.1)), mixed = sum_of(scene(2, each, false, 0.1, half));
    CHECK(mixed.dissipated > 0.01 * whole.dissipated);
    CHECK(mixed.dissipated < 0.9 * whole.dissipated);
    CHECK_MESSAGE(mixed.missing <= 0.02 * mixed.initial, mixed.missing, " J of ", mixed.initial, " J are missing");
  }
  const std::string failing = "[damage]\ntype = \"critical_stretch\"\nstretch = 0.006\n";
  for (const char* each : {"type = \"baqp\"", "type = \"conventional\""}) {
    INFO(fmt::format("{}, bonds fail", each));
    const auto simulation = build(scene(2, each, false, 0.1, failing));
    const auto watch = contract::run(*simulation);
    const Energies& end = watch.energies.back();
    CHECK(end.dissipated_by_laws > 0.02 * watch.energies.front().kinetic);
    CHECK_MESSAGE(end.dissipated != end.dissipated_by_laws, "no bond has failed");
    const Sum sum = sum_of(watch.energies);
    CHECK_FALSE(sum.falls);
    CHECK_MESSAGE(sum.missing <= 0.03 * sum.initial, sum.missing, " J of ", sum.initial, " J are missing");
  }
  const int threads = thread_count();
  std::vector<double> first;
  for (const int count : {1, 3}) {
    set_thread_count(count);
    std::vector<double> all;
    for (const Energies& e : contract::run(*build(scene(2, kinematics[2], true, 0.5))).energies) all.push_back(e.dissipated_by_laws);
    if (first.empty()) first = all;
    CHECK(all == first);
  }
  set_thread_count(threads);
  const auto simulation = build(scene(2, kinematics[2], false, 0.5));
  contract::run(*simulation);
  BodyProblem& problem = simulation->problem();
  const std::vector<std::byte> saved = problem.snapshot();
  const double dissipated = problem.state().energies.dissipated_by_laws;
  problem.state().energies = {};
  problem.restore(saved);
  CHECK(problem.state().energies.dissipated_by_laws == dissipated);
}
