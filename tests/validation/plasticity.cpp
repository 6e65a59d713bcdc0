/// Plastic bodies: Hill's tube against its limit pressure, every integrator, and runs that go on and are shared among threads to the bit.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "perikit/core/parallel.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;
using contract::BodyOptions;

namespace {

constexpr double Y = 0.02;

/// A plate, held at its left, that is pulled and sheared at its right until parts of it flow.
BodyOptions plate(const std::string& plane, const std::string& integrator, const std::string& motion) {
  BodyOptions body;
  body.dimension = 2;
  body.cells = 10;
  body.plane = plane;
  body.material = fmt::format("type = \"j2\"\ndensity = 1\nyoungs_modulus = 2.0\npoisson_ratio = 0.3\nyield_stress = {}\nhardening = 0.05\nsaturation_stress = 0.03\nsaturation_rate = 20", Y);
  body.sets = "left = \"x < 2\"\nright = \"x > 6\"\n";
  body.conditions = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"right\"\ndisplacement = " + motion + "\n";
  body.integrator = "type = \"" + integrator + "\"\n";
  return body;
}

const std::string statics = "steps = 6\ntolerance = 1e-9\n";
const std::string kinematics = "type = \"baqp\"";
const std::vector<std::string> quasi_static{"newton", "jfnk", "kinsol", "dynamic_relaxation"};

std::unique_ptr<Simulation> build_plate(const std::string& plane, const std::string& integrator, const std::string& keys, const std::string& motion = "[\"0.4*sin(pi*t)\", \"0.2*t\"]") {   // there and back
  BodyOptions body = plate(plane, integrator, motion);
  body.integrator += keys;
  return build(contract::scene_text(body, kinematics));
}

/// The largest of all that is remembered: an equivalent plastic strain.
double most_plastic(Simulation& simulation) {
  double most = 0;
  for (const double value : std::as_const(*simulation.problem().terms().material_points()).values()) most = std::max(most, value);
  return most;
}

}  // namespace

TEST_CASE("Hill's tube: the limit pressure, and residuals that fall quadratically") {
  constexpr double a = 0.1, b = 0.2, drive = 0.6e-3, yield = 0.24e9;
  const auto simulation = load("plasticity/hill_tube.toml", {"constants.n=16", "integrator.steps=12", "run.threads=1"});
  contract::Watch watch(*simulation);
  simulation->run(watch);
  REQUIRE(watch.reports.size() == 13);
  // What the inner surface does of work, over the area that it passes in the last step.
  const auto last = watch.energies.size() - 1;
  const double step = watch.reports[last].time - watch.reports[last - 1].time;
  const double pressure = (watch.energies[last].external_work - watch.energies[last - 1].external_work) / (step * drive * a * std::numbers::pi / 2);
  // Of the tube as it is by then, over the inner surface as it was: the wall keeps its volume.
  const double a_now = a + (1 - step / 2) * drive, b_now = std::sqrt(b * b + a_now * a_now - a * a);
  const double limit = 2 / std::sqrt(3.0) * yield * std::log(b_now / a_now) * a_now / a;
  CHECK(limit == doctest::Approx(0.19209e9).epsilon(1e-3));
  CHECK_MESSAGE(std::abs(pressure / limit - 1) <= 0.01, pressure, ", Hill's ", limit);
  for (const StepReport& report : watch.reports) CHECK_MESSAGE(report.iterations <= 8, "step ", report.step, ": ", report.iterations, " iterations");
  const Energies& energies = watch.energies[last];
  CHECK(energies.dissipated > 2 * energies.strain);
  CHECK(energies.strain + energies.dissipated == doctest::Approx(energies.external_work).epsilon(5e-3));
}

TEST_CASE("every solver of statics finds the same plastic plate, in all planes, there and back") {
  for (const std::string plane : {"strain", "stress"}) {
    std::unique_ptr<Simulation> first;
    for (const std::string& integrator : quasi_static) {
      INFO(plane, ", ", integrator);
      auto simulation = build_plate(plane, integrator, statics);
      contract::Watch watch(*simulation);
      simulation->run(watch);
      CHECK(watch.reports.back().time == 1.0);
      for (std::size_t n = 1; n < watch.energies.size(); ++n) CHECK(watch.energies[n].dissipated >= watch.energies[n - 1].dissipated);
      CHECK(most_plastic(*simulation) > 0.02);
      if (first) {
        CHECK_MESSAGE(distance(*first, *simulation) <= 1e-6 * 0.4, distance(*first, *simulation));
        CHECK(simulation->problem().state().energies.dissipated == doctest::Approx(first->problem().state().energies.dissipated).epsilon(1e-6));
      } else {
        first = std::move(simulation);
      }
    }
  }
}

TEST_CASE("plastic runs are the same to the bit with one, two and three threads, and go on to the bit after a stop") {
  const int threads = thread_count();
  const auto end = [](Simulation& simulation) { return contract::state(simulation); };
  for (const std::string integrator : {"verlet", "newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    const bool explicit_run = integrator == "verlet";
    const std::string keys = explicit_run ? "end_time = 3.0\n" : "steps = 4\ntolerance = 1e-7\n";
    const auto make = [&] { return build_plate("strain", integrator, keys); };
    const auto whole = make(), stopped = make(), again = make();
    set_thread_count(1);
    const std::int64_t steps = contract::run(*whole).reports.back().step;
    CHECK(most_plastic(*whole) > 0.005);
    if (explicit_run || integrator == "jfnk" || integrator == "dynamic_relaxation")   // factorised solves agree to rounding
      for (const int count : {2, 3}) {
        set_thread_count(count);
        const auto other = make();
        contract::run(*other);
        CHECK_MESSAGE(end(*other) == end(*whole), count, " threads");
      }
    set_thread_count(1);
    contract::run(*stopped, steps / 2);
    again->problem().restore(stopped->problem().snapshot());
    contract::run(*again);
    CHECK(end(*again) == end(*whole));
  }
  set_thread_count(threads);
}

TEST_CASE("explicit: a plastic plate that is pulled dissipates, and its energies add up") {
  const auto simulation = build_plate("stress", "verlet", "end_time = 12.0\nsafety = 0.2\n", "[\"0.005*t^2\", 0]");
  contract::Watch watch(*simulation);
  simulation->run(watch);
  const Energies& energies = watch.energies.back();
  CHECK(energies.dissipated > energies.strain);
  CHECK_MESSAGE(std::abs(energies.strain + energies.kinetic + energies.dissipated - energies.external_work) <= 0.01 * energies.external_work, energies.strain, " + ", energies.kinetic, " + ",
                energies.dissipated, ", work ", energies.external_work);
}
