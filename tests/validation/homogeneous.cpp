/// Homogeneous states with closed forms, through whole scenes and every kinematics that has gradients: Scabbia et al.,
/// section 4.1, Hashim et al., section 4.1, Partmann et al., eqs. 5.2-5.3.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Every kinematics with gradients, with each of its example tables, as an override; selective ones only where asked for.
std::vector<std::string> kinematics_overrides(int dimension, bool selective) {
  std::vector<std::string> all;
  for (const std::string& name : registry().names(Kind::kinematics)) {
    if (name == "bond_based" || name == "ordinary" || (name == "selective" && !selective)) continue;
    for (std::string table : registry().describe(Kind::kinematics, name).examples) {
      if (table.find("parts") != std::string::npos && dimension != 1) continue;  // a choice of one-dimensional bodies
      for (std::size_t at = table.find('\n'); at != std::string::npos; at = table.find('\n')) table.replace(at, 1, ", ");
      all.push_back(fmt::format("kinematics={{ type = \"{}\"{}{} }}", name, table.empty() ? "" : ", ", table));
    }
  }
  if (selective) all.push_back("kinematics={ type = \"selective\", base = { type = \"bond_associated\" } }");
  return all;
}

/// What must hold at every point; P and sigma by rows, names as in the paper.
struct HomogeneousState {
  double psi;
  std::array<double, 9> P, sigma;
};

/// Component ij of a sampled tensor, stored by space (P) or in full (sigma).
double component(ConstFieldView field, int dimension, int i, int j, std::int32_t p) {
  if (field.components == 9) return field.component(3 * i + j)[p];
  if (i < dimension && j < dimension) return field.component(i * dimension + j)[p];
  return i == j ? field.component(dimension * dimension + i - dimension)[p] : 0.0;
}

void check_state(const std::string& scene, std::vector<std::string> overrides, const HomogeneousState& expected, double tolerance) {
  const auto simulation = load(scene, overrides);
  BodyProblem& problem = simulation->problem();
  PointSamples samples;
  const EvaluationStatus status = problem.terms().sample({problem.state().displacement(), 0}, samples);
  REQUIRE_MESSAGE(status.ok(), status.description);
  double worst_P = 0, worst_sigma = 0, worst_psi = 0;
  for (const std::int32_t p : problem.body().internal()) {
    worst_psi = std::max(worst_psi, std::abs(samples.strain_energy_density.data()[p] - expected.psi));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const auto k = static_cast<std::size_t>(3 * i + j);
        worst_P = std::max(worst_P, std::abs(component(samples.P, problem.dimension(), i, j, p) - expected.P[k]));
        worst_sigma =
            std::max(worst_sigma, std::abs(component(samples.cauchy, problem.dimension(), i, j, p) - expected.sigma[k]));
      }
  }
  const std::string what = fmt::format("{} with {}", scene, fmt::join(overrides, ", "));
  CHECK_MESSAGE(worst_P <= tolerance, what, ": P is off by ", worst_P);
  CHECK_MESSAGE(worst_sigma <= tolerance, what, ": Cauchy stress is off by ", worst_sigma);
  CHECK_MESSAGE(worst_psi <= tolerance, what, ": energy density is off by ", worst_psi);
}

/// Neo-Hookean solid, mu = 1, with principal stretches l1, l2, 1.
struct Rubber {
  double kappa;
  double deviator(double l, double l1, double l2) const {
    return std::pow(l1 * l2, -2.0 / 3) * (l * l - (l1 * l1 + l2 * l2 + 1) / 3);
  }
  double tau(double l, double l1, double l2) const { return deviator(l, l1, l2) + kappa * (l1 * l2 - 1) * l1 * l2; }
  /// l2 of simple tension: tau_2 = 0, by bisection (tau_2 grows with l2).
  double lateral(double l1) const {
    double low = 0.5 / l1, high = 2 / l1;
    for (int i = 0; i < 200; ++i) (tau(0.5 * (low + high), l1, 0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
    return 0.5 * (low + high);
  }
  /// Simple tension or compression in plane strain.
  HomogeneousState tension(double l1) const {
    const double l2 = lateral(l1), J = l1 * l2, tau1 = std::pow(J, -2.0 / 3) * (l1 * l1 - l2 * l2), tau3 = tau(1.0, l1, l2);
    const double psi = 0.5 * (std::pow(J, -2.0 / 3) * (l1 * l1 + l2 * l2 + 1) - 3) + 0.5 * kappa * (J - 1) * (J - 1);
    return {psi, {tau1 / l1, 0, 0, 0, 0, 0, 0, 0, tau3}, {tau1 / J, 0, 0, 0, 0, 0, 0, 0, tau3 / J}};
  }
};

}  // namespace

TEST_CASE("Scabbia et al. 4.1: simple tension and compression in plane strain") {
  for (const double kappa : {20.0, 1e4})
    for (const double l1 : {0.6, 1.5}) {
      const Rubber rubber{kappa};
      const double l2 = rubber.lateral(l1);
      const HomogeneousState state = rubber.tension(l1);
      for (const std::string& kinematics : kinematics_overrides(2, true))
        check_state("scabbia/homogeneous.toml",
                    {kinematics, fmt::format("material.bulk_modulus={:.17g}", kappa), fmt::format("constants.l1={:.17g}", l1),
                     fmt::format("constants.l2={:.17g}", l2)},
                    state, 1e-8);
    }
}

TEST_CASE("Scabbia et al. 4.1: simple shear") {
  for (const double kappa : {20.0, 1e4})
    for (const double g : {0.1, 1.0}) {
      // tau = mu dev b, b = F F^T, P = tau F^-T
      const double x = 2 * g * g / 3, y = -g * g / 3;
      const HomogeneousState state{0.5 * g * g, {x - g * g, g, 0, g - g * y, y, 0, 0, 0, y}, {x, g, 0, g, y, 0, 0, 0, y}};
      for (const std::string& kinematics : kinematics_overrides(2, true))
        check_state("scabbia/homogeneous.toml",
                    {kinematics, fmt::format("material.bulk_modulus={:.17g}", kappa), "constants.l1=1.0", "constants.l2=1.0",
                     fmt::format("constants.gamma={:.17g}", g)},
                    state, 1e-8);
    }
}

TEST_CASE("Scabbia et al. 4.1: the scene as it stands") {
  const HomogeneousState state = Rubber{1e4}.tension(1.5);
  CHECK(state.P[0] == doctest::Approx(1.20359393).epsilon(1e-8));
  check_state("scabbia/homogeneous.toml", {}, state, 1e-8);
}

TEST_CASE("Hashim et al. 4.1: the hydrostatic state has a nominal traction of 494.1 kPa") {
  const double a = 1.61334, E = 1.2e6, nu = 0.2, lambda = E * nu / (1 + nu) / (1 - 2 * nu), mu = E / 2 / (1 + nu),
               h = std::log(a);
  const double tau = 2 * (lambda + mu) * h, tau3 = 2 * lambda * h, J = a * a;
  CHECK(tau / a == doctest::Approx(494.1e3).epsilon(1e-4));
  const HomogeneousState state{
      2 * (lambda + mu) * h * h, {tau / a, 0, 0, 0, tau / a, 0, 0, 0, tau3}, {tau / J, 0, 0, 0, tau / J, 0, 0, 0, tau3 / J}};
  for (const std::string& kinematics : kinematics_overrides(2, true))
    check_state("hashim/hydrostatic_state.toml", {kinematics, "body.lattice.spacing=0.1"}, state, 1e-8 * mu);
}

TEST_CASE("Partmann et al. 5.2-5.3: uniaxial stress of the Saint Venant-Kirchhoff bar") {
  const double E = 210000, nu = 0.25;
  for (const double l : {1.0093911060988523, 0.8, 1.3}) {
    const double sigma_0 = 0.5 * E * (l * l * l - l), green = 0.5 * (l * l - 1), J = l * (1 - nu * (l * l - 1));
    if (l < 1.1 && l > 1) CHECK(sigma_0 == doctest::Approx(2000).epsilon(1e-10));
    const HomogeneousState state{0.5 * E * green * green, {sigma_0}, {sigma_0 * l / J}};
    for (const std::string& kinematics : kinematics_overrides(3, false))
      check_state("partmann/uniaxial_stress.toml", {kinematics, fmt::format("constants.l={:.17g}", l)}, state, 1e-8 * E);
  }
}
