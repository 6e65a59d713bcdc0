/// Displacements that an averaged gradient does not see: the scenes of Partmann et al., section 4.4, and Roy Chowdhury et al., eq. 16,
/// run as they stand for every kinematics.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/eigen.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Averages at the one point of a set.
struct Sample {
  double density, H;   ///< strain energy density, first component of F - I
  std::size_t fallbacks, dropped_parts;
};

Sample sample(const std::string& scene, const std::string& set, std::vector<std::string> overrides) {
  const auto simulation = load(scene, std::move(overrides));
  BodyProblem& problem = simulation->problem();
  PointSamples samples;
  const EvaluationStatus status = problem.terms().sample({problem.state().displacement(), 0}, samples);
  REQUIRE_MESSAGE(status.ok(), status.description);
  const std::vector<std::int32_t>& points = problem.body().set(set);
  REQUIRE(points.size() == 1);
  const ModelReport report = problem.report();
  const double H = samples.H.components() > 0 ? samples.H.component(0)[points[0]] : 0.0;   // pair laws have none
  return {samples.strain_energy_density.data()[points[0]], H, report.fallbacks, report.dropped_parts};
}

/// The first example of a kinematics as an override of a scene.
std::string example_table(const std::string& kinematics) {
  std::string keys = registry().describe(Kind::kinematics, kinematics).examples.front();
  for (std::size_t at = keys.find('\n'); at != std::string::npos; at = keys.find('\n')) keys.replace(at, 1, ", ");
  return fmt::format("kinematics={{ type = \"{}\"{}{} }}", kinematics, keys.empty() ? "" : ", ", keys);
}

/// What the gradient of order n keeps of the amplitude of sin(pi s) on [-1, 1] at 0, in the limit of a fine lattice and a constant
/// influence: the linear coefficient of the best approximation by odd powers up to n, over pi.
double kept_amplitude(int order) {
  const int terms = (order + 1) / 2;
  Eigen::MatrixXd M(terms, terms);
  Eigen::VectorXd b(terms);
  double moment = 1 / std::numbers::pi;   // of s^i sin(pi s) over [0, 1], i = 1, 3, ...: (1 - i (i - 1) moment_(i-2) / pi) / pi
  for (int k = 0; k < terms; ++k) {
    const int i = 2 * k + 1;
    if (k > 0) moment = (1 - i * (i - 1) * moment / std::numbers::pi) / std::numbers::pi;
    b(k) = moment;
    for (int m = 0; m < terms; ++m) M(k, m) = 1.0 / (i + 2 * m + 2);
  }
  return M.fullPivLu().solve(b)(0) / std::numbers::pi;
}

}  // namespace

TEST_CASE("checkerboard: energy density of every kinematics and influence function") {
  struct Row {
    const char* kinematics;
    double constant, cubic_spline, gaussian;
  };
  const Row rows[] = {{"{ type = \"conventional\" }", 0, 0, 0},
                      {"{ type = \"baqp\" }", 1.037664e-1, 2.510877e-1, 1.247090e-1},
                      {"{ type = \"projection\" }", 1.037664e-1, 1.037664e-1, 1.037664e-1},
                      {"{ type = \"sub_horizon\" }", 4.268558e-2, 1.201349e-1, 4.733806e-2},
                      {"{ type = \"bond_associated\" }", 6.280168e-2, 1.227817e-1, 6.697986e-2},
                      {"{ type = \"bond_augmented\", lambda = 10.0 }", 2.333438e-3, 9.423944e-3, 2.572849e-3},
                      {"{ type = \"non_spherical\", n1 = 1.0, n2 = 1.0 }", 3.635143e-2, 3.635143e-2, 3.635143e-2}};
  for (const Row& row : rows) {
    const std::pair<const char*, double> columns[] = {{"constant", row.constant}, {"cubic_spline", row.cubic_spline}, {"gaussian", row.gaussian}};
    for (const auto& [influence, expected] : columns) {
      const double density = sample("partmann/checkerboard.toml", "inside",
                                    {fmt::format("kinematics={}", row.kinematics), fmt::format("family.influence={}", influence)}).density;
      // F - I of the conventional model is rounding; the densities of the others are of the order of 0.1.
      CHECK_MESSAGE(std::abs(density - expected) <= std::max(1e-6 * expected, 1e-20), row.kinematics, " ", influence, ": ", fmt::format("{:.6e}", density),
                    " against ", expected);
    }
  }
}

TEST_CASE("zig-zag: F = 1 in the conventional model, energy in every other one") {
  const Sample conventional = sample("partmann/zigzag.toml", "inside", {"kinematics={ type = \"conventional\" }"});
  CHECK(std::abs(conventional.H) <= 1e-16);
  CHECK(conventional.density <= 1e-28);
  for (const std::string& kinematics : registry().names(Kind::kinematics)) {
    if (kinematics == "conventional") continue;
    INFO(kinematics);
    // Pair laws have no gradients to show; the selective map needs uniaxial strain.
    CHECK(sample("partmann/zigzag.toml", "inside", {example_table(kinematics), "output.fields=[\"strain_energy_density\"]", "output.history=[]", "body.line=strain"}).density > 1e-3);
  }
  // By hand: two half-horizons of F - 1 = -+ 0.04; four parts hold one bond each, F - 1 = -+ 0.2 (inner) and 0 (outer).
  CHECK(sample("partmann/zigzag.toml", "inside", {}).density == doctest::Approx(0.8).epsilon(1e-12));
  CHECK(sample("partmann/zigzag.toml", "inside", {"kinematics.parts=4"}).density == doctest::Approx(0.5 * 1000 * 0.2 * 0.2 / 2).epsilon(1e-12));
}

TEST_CASE("zig-zag and checkerboard: the penalties store energy over the conventional model, whose F stays blind") {
  const auto bar = [](const char* table) { return sample("partmann/zigzag.toml", "inside", {fmt::format("kinematics={{ type = \"conventional\", stabilization = {} }}", table)}); };
  // By hand: z = 2 alpha in the two odd bonds. silling: C = 2 E/(A delta^3), 1/2 C 2 (2 alpha)^2; wan: M = E/K, K = 10.
  const double springs = 0.04 * 2 * 1000 / std::pow(2.015, 3);
  for (const auto& [table, expected] : {std::pair{"\"silling\"", springs}, std::pair{"{ type = \"silling\", coefficient = 0.25 }", 0.25 * springs}, std::pair{"\"wan\"", 4.0}}) {
    INFO(table);
    CHECK(bar(table).density == doctest::Approx(expected).epsilon(1e-12));
    CHECK(std::abs(bar(table).H) <= 1e-16);
    CHECK(sample("partmann/checkerboard.toml", "inside", {fmt::format("kinematics={{ type = \"conventional\", stabilization = {} }}", table)}).density > 1e-3);
  }
}

TEST_CASE("sub_horizon: parts without a gradient are dropped, their number must suit the dimension") {
  // The last point of either end has no outer half, and nothing else is missing.
  const Sample bar = sample("partmann/zigzag.toml", "inside", {});
  CHECK(bar.dropped_parts == 2);
  CHECK(bar.fallbacks == 0);
  // m = 1.1: the inner quarters are empty.
  CHECK(sample("partmann/zigzag.toml", "inside", {"kinematics.parts=4", "family.horizon_ratio=1.1"}).dropped_parts == 2 * 41 + 2);
  CHECK_THROWS_WITH_AS(sample("partmann/checkerboard.toml", "inside", {"kinematics={ type = \"sub_horizon\", parts = 4 }"}),
                       doctest::Contains("found 4 in a body of dimension 3; allowed: 1 or 8"), InputError);
}

TEST_CASE("sub_horizon: a part is a needle beside its family, not because its family is one") {
  // A strip of two rows: every point has two quadrants, 10 spacings long and one thick, corners have one. The eigenvalues of
  // their shape tensors are more than 100 apart, but so are those of the whole families.
  const std::vector<std::string> strip{
      "body={ dimension = 2, plane = \"strain\", lattice = { spacing = 1, lower = [0, 0], upper = [60, 2] } }",
      "sets.inside={ nearest = [20, 0.5] }", "family.horizon_ratio=10.015", "initial.displacement=[0, 0]"};
  CHECK(sample("partmann/zigzag.toml", "inside", strip).dropped_parts == 2 * 120 + 4);
}

TEST_CASE("sub_horizon: shares of the parts, equal or by volume") {
  // The second point of the bar, by hand: F - 1 = -0.2 in the half with one bond, 0.04 in the half with two.
  const double psi[] = {0.5 * 1000 * 0.2 * 0.2, 0.5 * 1000 * 0.04 * 0.04};
  const auto density = [](const char* weights) {
    return sample("partmann/zigzag.toml", "inside", {"sets.inside={ nearest = [1] }", fmt::format("kinematics.weights={}", weights)}).density;
  };
  CHECK(density("equal") == doctest::Approx((psi[0] + psi[1]) / 2).epsilon(1e-12));
  CHECK(density("volume") == doctest::Approx((psi[0] + 2 * psi[1]) / 3).epsilon(1e-12));
}

TEST_CASE("bond_associated: domains that are too poor use the whole family") {
  // Nearest neighbours only: the domain of a bond is that bond (and on a line that is enough).
  const Sample block = sample("partmann/checkerboard.toml", "inside", {"kinematics={ type = \"bond_associated\" }", "family.horizon_ratio=1.015"});
  CHECK(block.fallbacks == 3 * 2 * 15 * 16 * 16);
  CHECK(block.density <= 1e-20);
  const Sample bar = sample("partmann/zigzag.toml", "inside", {"kinematics={ type = \"bond_associated\" }", "family.horizon_ratio=1.015"});
  CHECK(bar.fallbacks == 0);
  CHECK(bar.density == doctest::Approx(0.5 * 1000 * 0.2 * 0.2).epsilon(1e-12));
}

TEST_CASE("sine: order 1 keeps 3/pi^2 of the amplitude, orders 3 and 6 approach all of it") {
  CHECK(kept_amplitude(1) == doctest::Approx(3 / (std::numbers::pi * std::numbers::pi)).epsilon(1e-14));
  CHECK(kept_amplitude(3) > 0.85);
  CHECK(kept_amplitude(6) > 0.98);
  // Ten times finer: the error falls with the square of the spacing.
  const double dx = 0.1 / 500.5;
  const std::string finer = fmt::format("body.lattice={{ spacing = {0:.17g}, lower = [{1:.17g}], upper = [{2:.17g}] }}", dx, -1001.5 * dx, 1001.5 * dx);
  for (const int order : {1, 3, 6}) {
    const std::string key = fmt::format("kinematics.order={}", order);
    const double limit = kept_amplitude(order);
    const double coarse = std::abs(sample("chowdhury/sine.toml", "crest", {key}).H / 0.9 - limit);
    CHECK(coarse <= 2e-3);
    CHECK(std::abs(sample("chowdhury/sine.toml", "crest", {key, finer}).H / 0.9 - limit) <= 0.015 * coarse);
  }
}

TEST_CASE("spectrum: the energy of short waves vanishes for conventional alone") {
  const auto spectrum = [](const std::string& kinematics, int k) {
    const auto simulation = load("chowdhury/spectrum.toml", {kinematics, fmt::format("constants.k={}", k), "body.lattice.spacing=0.002", "body.line=strain"});
    BodyProblem& problem = simulation->problem();
    PointSamples samples;
    REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, samples).ok());
    double sum = 0;
    for (const std::int32_t p : problem.body().set("inside")) sum += samples.strain_energy_density.data()[p];
    return sum;
  };
  for (const std::string& name : registry().names(Kind::kinematics)) {
    INFO(name);
    const std::string kinematics = example_table(name);
    const double longest = spectrum(kinematics, 10);
    double least = std::numeric_limits<double>::infinity();
    for (int k = 50; k <= 500; k += 50) least = std::min(least, spectrum(kinematics, k) / longest);
    if (name == "conventional") CHECK(spectrum(kinematics, 500) <= 1e-20 * longest);
    else CHECK(least > 1);
  }
}
