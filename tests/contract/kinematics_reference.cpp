/// The engine against the dense reference (dense_reference.hpp), which shares no code with it: energies and forces of every
/// kinematics that the reference knows, on lattices and clouds, intact and cracked.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/fixture.hpp"
#include "tests/contract/reference_body.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double youngs_modulus = 2.0, poisson_ratio = 0.3;   // of BodyOptions

/// The reference's description of a kinematics; nothing where the reference does not know the part.
std::optional<reference::Description> description_of(const PartValues& part) {
  static const std::vector<std::string> known{"conventional", "sub_horizon", "bond_associated", "baqp", "projection", "bond_augmented", "non_spherical", "selective"};
  if (std::find(known.begin(), known.end(), part.type) == known.end()) return std::nullopt;
  const ParameterValues& values = part.values;
  reference::Description description{.name = part.type, .singular = 1e-8};   // the engine's limit
  if (values.has("order")) description.order = static_cast<int>(values.integer("order"));
  if (values.has("parts")) description.parts = static_cast<int>(values.integer("parts"));
  if (values.has("weights")) description.part_volumes = values.text("weights") == "volume";
  if (values.has("bond_horizon_ratio")) description.bond_horizon_ratio = values.number("bond_horizon_ratio");
  if (values.has("lambda")) description.lambda = values.number("lambda");
  if (values.has("n1")) description.n1 = values.number("n1");
  if (values.has("n2")) description.n2 = values.number("n2");
  if (values.has("weight")) description.weight = values.text("weight") == "kernel" ? reference::Weight::kernel : reference::Weight::volume;
  if (values.has("force_state")) description.local_force = values.text("force_state") == "local";
  if (values.has("base")) {
    const auto base = description_of(values.part("base"));
    if (!base) return std::nullopt;
    description.base = std::make_shared<const reference::Description>(*base);
  }
  return description;
}

/// S = lambda tr(E) I + 2 mu E.
reference::Law saint_venant_kirchhoff() {
  using reference::Tensor;
  const double mu = youngs_modulus / (2 * (1 + poisson_ratio)), lambda = 2 * mu * poisson_ratio / (1 - 2 * poisson_ratio);
  const auto strain = [](const Tensor& H) -> Tensor { return (H + H.transpose() + H.transpose() * H) / 2; };
  const auto stress = [=](const Tensor& E) -> Tensor { return lambda * E.trace() * Tensor::Identity() + 2 * mu * E; };
  return {[=](const Tensor& H) { return 0.5 * strain(H).cwiseProduct(stress(strain(H))).sum(); },
          [=](const Tensor& H) -> Tensor { return (Tensor::Identity() + H) * stress(strain(H)); },
          [=](const Tensor& H) {   // dP = dF S + F stress(dE), dE = sym(F^T dF); column by column
            const Tensor F = Tensor::Identity() + H, S = stress(strain(H));
            reference::Matrix A(9, 9);
            for (int k = 0; k < 9; ++k) {
              Tensor dF = Tensor::Zero();
              dF(k / 3, k % 3) = 1;
              const Tensor square = F.transpose() * dF, dP = dF * S + F * stress((square + square.transpose()) / 2);
              for (int r = 0; r < 9; ++r) A(r, k) = dP(r / 3, r % 3);
            }
            return A;
          }};
}

std::vector<BodyOptions> bodies() {
  std::vector<BodyOptions> all;
  for (int d = 1; d <= 3; ++d)
    for (const bool cloud : {false, true})
      for (const bool crack : {false, true}) {
        if (crack && d == 1) continue;
        BodyOptions body;
        body.dimension = d;
        body.cloud = cloud;
        body.crack = crack;
        body.cells = d == 3 ? 7 : d == 2 ? 10 : 20;
        all.push_back(body);
      }
  return all;
}

}  // namespace

TEST_CASE("kinematics: agrees with the dense reference") {
  constexpr double tolerance = 1e-11;   // of the largest force; and of the energy
  for (const Example& example : examples(Kind::kinematics)) {
    const auto part = parse_part(Kind::kinematics, example.part, example.table, subject().registry);
    const auto description = description_of(*part);
    if (!description) {
      MESSAGE("no dense reference of kinematics '" << example.part << "'");
      continue;
    }
    for (const BodyOptions& options : bodies()) {
      INFO(fmt::format("{} ({}) {}D {}{}", example.part, example.table, options.dimension, options.cloud ? "cloud" : "lattice", options.crack ? " cracked" : ""));
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      deform(body, problem.displacement(), 61, 0.02);
      const auto d = static_cast<Eigen::Index>(body.dimension()), n = static_cast<Eigen::Index>(body.points());
      const reference::Vector u = dense(body, problem.displacement());
      const auto influence = subject().registry.influence(*simulation->scene().influence);
      const reference::Operator op = reference::build(cloud_of(body, *influence), *description);
      const reference::Vector expected = reference::force(op, saint_venant_kirchhoff(), u);
      const double expected_energy = reference::energy(op, saint_venant_kirchhoff(), u), scale = expected.cwiseAbs().maxCoeff();
      double energy = 0, worst = 0;
      Eigen::Index at = 0;
      REQUIRE(problem.evaluate_forces(problem.displacement(), problem.internal_force(), &energy).ok());
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index c = 0; c < d; ++c) {
          const double error = std::abs(problem.internal_force().component(static_cast<int>(c))[body.internal()[static_cast<std::size_t>(i)]] - expected[d * i + c]);
          if (!(error <= worst)) worst = error, at = i;
        }
      CHECK_MESSAGE(std::abs(energy - expected_energy) <= tolerance * expected_energy, "energy ", energy, ", reference ", expected_energy);
      CHECK_MESSAGE(worst <= tolerance * scale, "force at point ", at, " is off by ", worst, " of ", scale);
    }
  }
}
