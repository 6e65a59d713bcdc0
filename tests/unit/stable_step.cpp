/// The bond-based estimate of the stable step, in each space against the springs that the space sees.

#include "perikit/sdk/stable_step.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "setup/body/body.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

constexpr double lambda = 3.0, mu = 1.0, density = 2.0, spacing = 0.1, ratio = 1.2;  // of the horizon: nearest neighbours alone

/// A law with these moduli whatever it is given.
class Isotropic final : public Material {
 public:
  MaterialTraits traits() const noexcept override { return {}; }
  void constants(const MaterialInput&, double*) const override {}
  Moduli small_strain(const double*) const noexcept override { return {lambda, mu}; }
  Status evaluate(Space, const MaterialBatch&) const noexcept override { return {}; }
};

double estimate(int dimension, const char* space) {
  FakeCatalogue parts;
  const std::string text = SceneText{.dimension = dimension, .space = space, .spacing = spacing, .upper = std::vector<double>(static_cast<std::size_t>(dimension), 1.0),
                                     .family = fmt::format("horizon_ratio = {}", ratio), .integrator = "newton"};
  const Scene scene = parse_scene(text, "bar.toml", parts);
  const Body body = build_body(scene);
  std::vector<MaterialRecord> records(1);
  records[0].material = std::make_shared<Isotropic>();
  records[0].constants.resize(1);
  records[0].density = density;
  return bond_based_time_step(body, Laws(body.space(), std::move(records), {}, body.stride()));
}

/// dt for springs of this micromodulus to the 2 d nearest neighbours; sections are 1.
double expected(int d, double micromodulus) {
  return std::sqrt(2 * density / (micromodulus * 2 * d * std::pow(spacing, d - 1)));
}

}  // namespace

TEST_CASE("stable step: the bond-based estimate takes the modulus that the space sees") {
  const double delta = ratio * spacing, pi = std::numbers::pi, E = mu * (3 * lambda + 2 * mu) / (lambda + mu),
               nu = lambda / (2 * (lambda + mu));
  const double bar = 2 / (delta * delta), plate = 12 / (pi * std::pow(delta, 3)), block = 18 / (pi * std::pow(delta, 4));
  CHECK(estimate(1, "strain") == doctest::Approx(expected(1, bar * (lambda + 2 * mu))).epsilon(1e-12));
  CHECK(estimate(1, "stress") == doctest::Approx(expected(1, bar * E)).epsilon(1e-12));
  CHECK(estimate(2, "strain") == doctest::Approx(expected(2, plate * (lambda + mu))).epsilon(1e-12));
  CHECK(estimate(2, "stress") == doctest::Approx(expected(2, plate * E / (2 * (1 - nu)))).epsilon(1e-12));
  CHECK(estimate(3, "") == doctest::Approx(expected(3, block * (lambda + 2 * mu / 3))).epsilon(1e-12));
}
