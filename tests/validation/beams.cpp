/// Slender beams of Hashim et al., sections 4.2 and 4.4, by Newton's method: deflections, and residuals that fall quadratically.

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

TEST_CASE("clamped beam: von Karman's deflection within what the paper's unstabilised model misses, four iterations a step") {
  struct Row {
    const char* horizon_ratio;
    double error;  // relative; a value of our own, so that a change shows
    double paper;  // Table 1
    double within;
  };
  for (const Row row : {Row{"1.015", 0.0257, 0.02683, 0.0015}, Row{"2.015", 0.1166, 0.1216, 0.006}}) {
    INFO("horizon ratio ", row.horizon_ratio);
    const auto simulation = load("hashim/clamped_beam.toml", {std::string("constants.m=") + row.horizon_ratio});
    const Protocol protocol = run(*simulation);
    const double deflection = -mean(*simulation, "middle", 1) / 5.08e-3, error = deflection / 0.61344 - 1;
    CHECK_MESSAGE(std::abs(error - row.error) < 0.001, "error ", error);
    CHECK_MESSAGE(std::abs(error - row.paper) < row.within, "error ", error);
    CHECK(protocol.reports.size() == 11);
    CHECK(protocol.reports.back().iterations <= 4);
    CHECK(protocol.most_iterations() <= 7);
    CHECK(protocol.reports.back().residual <= 1e-10);
  }
}

TEST_CASE("cantilever: ten planned load steps, without stabilisation") {
  const auto simulation = load("hashim/cantilever.toml", {"constants.m=1.015", "kinematics={ type = \"projection\" }"});
  const Protocol protocol = run(*simulation);
  // Elastica of what these points are: the inertia of five rows is 24/25 of the depth's, and the last held points lie half a spacing outside of the beam,
  // 10 m from the load. (For the whole depth and 9.9 m, 8.004 and 5.451 m.)
  CHECK(std::abs(mean(*simulation, "tip", 1) / -8.148 - 1) < 0.015);
  CHECK(std::abs(mean(*simulation, "tip", 0) / -5.637 - 1) < 0.015);
  CHECK(protocol.reports.back().iterations <= 5);
  CHECK(protocol.reports.back().residual <= 1e-10);
}

TEST_CASE("cantilever under 10 kN: the paper's deflections of its own model without stabilisation") {
  struct Row {
    const char* horizon_ratio;
    double paper;  // Fig. 25, over the length
  };
  for (const Row row : {Row{"1.015", 0.302}, Row{"2.015", 0.342}, Row{"3.015", 0.529}}) {
    const auto simulation = load("hashim/cantilever.toml", {std::string("constants.m=") + row.horizon_ratio, "kinematics={ type = \"conventional\" }",
                                                            "load=[{ set = \"end\", force = [0, -10.0e3] }]"});
    run(*simulation);
    const double deflection = -mean(*simulation, "tip", 1) / 10;
    CHECK_MESSAGE(std::abs(deflection / row.paper - 1) < 0.035, "horizon ratio ", row.horizon_ratio, ": ", deflection);
  }
}

TEST_CASE("simply supported beam: deflection, and residuals that fall quadratically") {
  const auto simulation = load("hashim/simply_supported_beam.toml", {"constants.n=3"});
  const Protocol protocol = run(*simulation);
  const double error = -mean(*simulation, "middle", 1) / 5.08e-3 / 0.98075 - 1;
  // A value of our own, so that a change shows: the paper prints none, and the beam gives way around the one point that holds it. The next test holds the beam's
  // deflection with ends that do not.
  CHECK_MESSAGE(std::abs(error - 0.019) < 0.001, "error ", error);
  CHECK(protocol.reports.size() == 11);
  CHECK(protocol.reports.back().iterations <= 4);
  CHECK(protocol.most_iterations() <= 6);
}

TEST_CASE("simply supported beam: with ends that turn as blocks the deflection converges to the beam's") {
  double last = 1;
  for (const char* points : {"3", "5", "9"}) {
    const auto simulation = load("hashim/simply_supported_beam.toml",
                                 {std::string("constants.n=") + points, "body.lattice.lower=[\"-3*5.08e-3/n\", 0]",
                                  "region=[{ set = \"block\", material = { type = \"hencky\", youngs_modulus = 68.95e12, poisson_ratio = 0.25 } }]"});
    run(*simulation);
    const double error = std::abs(-mean(*simulation, "middle", 1) / 5.08e-3 / 0.98075 - 1);
    CHECK_MESSAGE(error < 0.8 * last, points, " points: error ", error);
    last = error;
  }
  CHECK_MESSAGE(last < 0.004, "error ", last);
}

TEST_CASE("cantilever in three load steps: jfnk neither stalls nor cuts back, and takes no more iterations on a finer lattice") {
  int linear[2] = {};
  for (const int k : {0, 1}) {
    const auto simulation = load("work_precision/cantilever.toml",
                                 {k == 0 ? "constants.n=5" : "constants.n=9", "integrator.type=\"jfnk\"", "integrator.steps=3"});
    const Protocol protocol = run(*simulation);
    CHECK(protocol.reports.size() == 4);
    CHECK(protocol.reports.back().residual <= 1e-8);
    CHECK(protocol.text.find("no equilibrium") == std::string::npos);
    for (std::size_t at = protocol.text.find("gmres "); at != std::string::npos; at = protocol.text.find("gmres ", at + 1))
      linear[k] += std::atoi(&protocol.text[at + 6]);
  }
  MESSAGE(linear[0], " and ", linear[1], " GMRES iterations");
  CHECK(linear[0] <= 200);
  CHECK(linear[1] <= 1.2 * linear[0]);
}

// The small version of configs/studies/implicit_relaxation.toml.
TEST_CASE("clamped beam: implicit integrators and dynamic relaxation err alike, at very unlike cost") {
  double deflection = 0;
  int cost = 0;
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    const std::string most = integrator == "dynamic_relaxation" ? ", max_iterations = 1000000" : "";
    const auto simulation =
        load("hashim/clamped_beam.toml",
             {"constants.n=3", "integrator={ type = \"" + integrator + "\", steps = 2, tolerance = 1e-6" + most + " }"});
    const Protocol protocol = run(*simulation);
    CHECK(protocol.reports.back().residual <= 1e-6);
    const double found = -mean(*simulation, "middle", 1) / 5.08e-3;
    if (integrator == "newton") {
      // The paper's Table 1 has 6.678 %, for ten steps and all errors of its own reference; 6.4 % is a value of our own.
      CHECK_MESSAGE(std::abs(found / 0.61344 - 1.06678) < 0.0035, "error ", found / 0.61344 - 1);
      CHECK_MESSAGE(std::abs(found / 0.61344 - 1.064) < 0.001, "error ", found / 0.61344 - 1);
      deflection = found;
      cost = protocol.iterations();
    } else {
      CHECK_MESSAGE(std::abs(found / deflection - 1) < 1e-3, "deflection ", found, " and ", deflection);
    }
    // An iteration of relaxation is a force evaluation; one of Newton's method costs as much as some tens of them.
    if (integrator == "dynamic_relaxation")
      CHECK(protocol.iterations() > 500 * cost);
    else
      CHECK(protocol.iterations() < 3 * cost);
  }
}
