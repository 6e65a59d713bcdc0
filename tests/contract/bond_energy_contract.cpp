/// What bonds hold: the shares of all bonds add up to the stored energy, and criteria by energy and stress let those fail that
/// hold too much.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <stdexcept>

#include "fracture/search/bond_criterion.hpp"
#include "tests/contract/bonds_that_fail.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/contract/reference_body.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Deforms the body with noise so that every direction grows; its energy.
double respond(BodyProblem& problem, std::uint64_t seed) {
  stretch_at_random(problem.body(), problem.state().displacement(), seed);
  return energy_of(problem, problem.state().displacement());
}

/// Bonds that cross a unit of area, about.
double crossing(const Body& body) {
  switch (body.dimension()) {
    case 1: return 0.5 * body.section() * std::pow(body.horizon(), 2);
    case 2: return 0.667 * body.section() * std::pow(body.horizon(), 3);
    default: return 0.785 * std::pow(body.horizon(), 4);
  }
}

/// The bonds that fail, some of `bonds`: the same ones whether evaluations of forces said which to look at, did not, or were not to.
std::set<std::pair<std::int32_t, std::int32_t>> fail_screened_or_not(BodyOptions options, const std::string& kinematics, std::size_t bonds) {
  const std::string text = scene_text(options, kinematics);
  options.skip = false;
  const auto screened = build(text), unscreened = build(text), slow = build(scene_text(options, kinematics));
  respond(screened->problem(), 23);
  const FieldView u = screened->problem().state().displacement();
  const BondUpdate update = screened->problem().fracture()->update({u, 0}, 0);
  CHECK(update.changed > 0);
  CHECK(update.changed < bonds);
  std::set<std::pair<std::int32_t, std::int32_t>> failed;
  for (const BondChange& b : screened->problem().families().changed()) failed.emplace(b.bond.point, b.bond.far);
  for (auto* other : {unscreened.get(), slow.get()}) {
    CHECK(other->problem().fracture()->update({u, 0}, 0).changed == update.changed);
    for (const BondChange& b : other->problem().families().changed()) CHECK(failed.contains({b.bond.point, b.bond.far}));
  }
  return failed;
}

}  // namespace

TEST_CASE("kinematics: bonds share the stored energy, and those that hold the most of it fail by it, screened or not") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d) || formulation_of(example).force_state == ForceState::local) continue;
        BodyOptions options{.dimension = d, .cloud = cloud};
        const auto plain = build(scene_text(options, kinematics_table(example)));
        const double whole = respond(plain->problem(), 23);
        const Body& body = plain->problem().body();
        const std::vector<BondEnergy> shares = bond_energies(plain->problem().terms(), {plain->problem().state().displacement(), 0});
        double sum = 0;
        std::vector<double> densities;
        const auto density = [&](const BondEnergy& b) {
          return b.energy /
                 (body.volume(static_cast<std::size_t>(b.bond.point)) * body.volume(static_cast<std::size_t>(b.bond.far)));
        };
        for (std::size_t k = 0; k < shares.size(); ++k) {
          if (k > 0) REQUIRE(shares[k - 1].bond < shares[k].bond);
          sum += shares[k].energy;
          densities.push_back(density(shares[k]));
        }
        CHECK(std::abs(sum - whole) <= 1e-12 * whole);
        std::sort(densities.begin(), densities.end());
        options.conditions = fmt::format(
            "[damage]\ntype = \"critical_energy\"\nsecond_law = false\nenergy = \"held\"\nlimit = \"equal\"\nno_fail = "
            "[\"part\"]\nenergy_release_rate = {:.17g}\n",
            crossing(body) * densities[densities.size() * 9 / 10]);
        const std::set<std::pair<std::int32_t, std::int32_t>> failed = fail_screened_or_not(options, kinematics_table(example), shares.size());
        if (plain->problem().terms().has_gradients()) continue;  // fragments lose all of their bonds
        const std::set<std::int32_t> safe(body.set("part").begin(), body.set("part").end());
        double least = INFINITY, most = 0;
        for (const BondEnergy& b : shares) {
          const bool gone = failed.contains({b.bond.point, b.bond.far});
          if (safe.contains(b.bond.point) || safe.contains(b.bond.far))
            CHECK(!gone);
          else if (gone)
            least = std::min(least, density(b));
          else
            most = std::max(most, density(b));
        }
        CHECK(most < least);
      }
}

TEST_CASE("kinematics: what a bond sets free is the derivative of the stored energy by its integrity, and bonds fail by it, screened or not") {
  enum class PointSet { lattice, cloud, consistent_cloud };
  for (const Example& example : kinematics_examples())
    for (const PointSet points : {PointSet::lattice, PointSet::cloud, PointSet::consistent_cloud})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", points == PointSet::lattice ? "lattice" : "cloud",
             points == PointSet::consistent_cloud ? ", consistent" : "");
        if (!bonds_may_fail(example, d) || formulation_of(example).force_state == ForceState::local) continue;
        const Formulation formulation = formulation_of(example);
        // Of these no consistent form is known.
        if (points == PointSet::consistent_cloud && (formulation.pairs || formulation.order > 1 || (formulation.selective() && !formulation.bond))) continue;
        BodyOptions options{.dimension = d, .cloud = points != PointSet::lattice, .consistent = points == PointSet::consistent_cloud};
        const char* const weakening =
            "[damage]\ntype = \"critical_energy\"\nsecond_law = false\nenergy = \"{}\"\nsoftening = {}\nenergy_release_rate = "
            "{:.17g}\n";
        options.conditions = fmt::format(fmt::runtime(weakening), "held", "2.0", 1e9);
        const auto simulation = build(scene_text(options, kinematics_table(example)));
        BodyProblem& problem = simulation->problem();
        respond(problem, 23);
        const FieldView u = problem.state().displacement();
        const bool higher = formulation.order > 1, parts = formulation.weighted && formulation.parts(d) > 0;
        const bool linear = example.stabilization.find("linear") != std::string::npos;
        if (formulation.pairs || (higher && (formulation.selective() || linear)) || (parts && formulation.selective())) {
          CHECK_THROWS_AS(bond_energies(problem.terms(), {u, 0}, true), std::logic_error);
          continue;
        }
        // Some bonds have weakened.
        std::vector<BondEnergy> released = bond_energies(problem.terms(), {u, 0}, true);
        std::mt19937_64 random(7);
        std::vector<BondChange> state;
        for (std::size_t k = 0; k < released.size(); k += 1 + random() % 3)
          state.push_back({released[k].bond, 0.4 + 0.5 * static_cast<double>(random() % 1000) / 1000});
        problem.fracture()->restore(state);
        released = bond_energies(problem.terms(), {u, 0}, true);
        double most = 0;
        for (const BondEnergy& b : released) most = std::max(most, std::abs(b.energy));
        Field force = problem.make_field();
        const auto energy_with = [&](std::size_t k, double b) {
          std::vector<BondChange> changed = state;
          changed[k].integrity = b;
          problem.fracture()->restore(changed);
          double energy = 0;
          REQUIRE(problem.evaluate_forces({u, 0}, force, &energy).ok());
          return energy;
        };
        double whole = 0;
        REQUIRE(problem.evaluate_forces({u, 0}, force, &whole).ok());
        constexpr double h = 1e-4;
        for (std::size_t n = 0; n < 6; ++n) {
          const std::size_t k = n * (state.size() - 1) / 5;
          const auto at = std::ranges::lower_bound(released, state[k].bond, {}, &BondEnergy::bond);
          REQUIRE(at->bond == state[k].bond);
          const double b = state[k].integrity, slope = (energy_with(k, b + h) - energy_with(k, b - h)) / (2 * h);
          INFO("bond ", state[k].bond.point, " ", state[k].bond.far, " of ", state.size(), ": found ", at->energy, ", slope ", slope);
          CHECK(std::abs(at->energy - slope) <= 1e-6 * most + 1e-12 * whole / h);
        }
        // Bonds break at once by it, as many whether the others are looked at or not.
        const Body& body = problem.body();
        problem.fracture()->restore({});
        std::vector<double> densities;
        for (const BondEnergy& b : bond_energies(problem.terms(), {u, 0}, true))
          densities.push_back(b.energy / (body.volume(static_cast<std::size_t>(b.bond.point)) * body.volume(static_cast<std::size_t>(b.bond.far))));
        std::ranges::sort(densities);
        // Between two of them: what is found from the forces that are there is the same but for rounding.
        const auto limit = densities.begin() + static_cast<std::ptrdiff_t>(densities.size() * 9 / 10);
        options.conditions = fmt::format(fmt::runtime(weakening), "released", "1.0", crossing(body) * 0.5 * (limit[0] + limit[-1])) +
                             "limit = \"equal\"\n";
        fail_screened_or_not(options, kinematics_table(example), released.size());
      }
}

TEST_CASE("kinematics: bonds fail by the largest principal stress, that of the material in an affine motion") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d) || formulation_of(example).pairs || formulation_of(example).force_state == ForceState::local)
          continue;
        BodyOptions options{.dimension = d, .cloud = cloud};
        const auto stretch = [](BodyProblem& of) {
          set_field(of.body(), of.state().displacement(), [](const Point& x) {
            return Point{0.03 * x[0], 0.01 * x[1], 0.02 * x[2]};
          });
        };
        const auto plain = build(scene_text(options, kinematics_table(example)));
        stretch(plain->problem());
        PointSamples samples;
        plain->problem().sample(samples);
        // Energies alone are those that come with the tensors, bit for bit.
        PointSamples energies{.asked = Sampling::energy};
        plain->problem().sample(energies);
        CHECK(energies.cauchy.size() == 0);
        for (const std::int32_t q : plain->problem().body().internal())
          CHECK(energies.strain_energy_density.data()[q] == samples.strain_energy_density.data()[q]);
        const std::int32_t p = plain->problem().body().internal().front();
        const double most = samples.cauchy.component(0)[p];
        for (const double share : {1 + 1e-9, 1 - 1e-9}) {
          options.conditions =
              fmt::format("[damage]\ntype = \"max_stress\"\nsecond_law = false\nstrength = {:.17g}\n", share * most);
          const auto simulation = build(scene_text(options, kinematics_table(example)));
          stretch(simulation->problem());
          const std::size_t bonds =
              bond_energies(simulation->problem().terms(), {simulation->problem().state().displacement(), 0}).size();
          const BondUpdate update = simulation->problem().fracture()->update({simulation->problem().state().displacement(), 0}, 0);
          CHECK(update.changed == (share > 1 ? 0 : bonds));
        }
      }
}
