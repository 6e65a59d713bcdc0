#include "tests/contract/reference_body.hpp"

#include <algorithm>

namespace perikit::contract {

namespace {

constexpr double youngs_modulus = 2.0, poisson_ratio = 0.3;   // of BodyOptions

}  // namespace

reference::Cloud cloud_of(const Body& body, const InfluenceFunction& influence) {
  reference::Cloud cloud;
  cloud.dimension = body.dimension();
  cloud.horizon = body.horizon();
  cloud.influence = [&influence](double r) {
    double omega = 0;
    influence.evaluate({&r, 1}, {&omega, 1});
    return omega;
  };
  std::vector<Point> position;
  for (const std::int32_t p : body.internal()) {
    position.push_back(body.position(static_cast<std::size_t>(p)));
    cloud.position.push_back(Eigen::Map<const reference::Vector>(position.back().data(), cloud.dimension));
    cloud.volume.push_back(body.volume(static_cast<std::size_t>(p)));
  }
  if (!body.cracks().empty()) {
    cloud.integrity = [&body, position](int i, int j) {
      return body.cut(position[static_cast<std::size_t>(i)], position[static_cast<std::size_t>(j)]) ? 0.0 : 1.0;
    };
  }
  return cloud;
}

reference::Elasticity elasticity(const Body& body) {
  constexpr double mu = youngs_modulus / (2 * (1 + poisson_ratio)), lambda = 2 * mu * poisson_ratio / (1 - 2 * poisson_ratio);
  switch (body.space()) {
    case Space::plane_stress: return {2 * lambda * mu / (lambda + 2 * mu), mu, body.section()};
    case Space::line_stress: return {youngs_modulus - 2 * mu, mu, body.section()};
    default: return {lambda, mu, body.section()};
  }
}

reference::Vector dense(const Body& body, ConstFieldView field) {
  const auto d = static_cast<std::size_t>(body.dimension()), n = body.points();
  reference::Vector values(static_cast<Eigen::Index>(d * n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < d; ++c) values[static_cast<Eigen::Index>(d * i + c)] = field.component(static_cast<int>(c))[body.internal()[i]];
  return values;
}

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

void set_cell(const PartValues& part, const Body& body, reference::Description& description) {
  const bool wanted = !part.values.has("cell_moments") || part.values.boolean("cell_moments");
  if (part.type == "conventional" && description.order > 1 && body.lattice() && wanted) description.cell = body.lattice()->spacing;
}

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

}  // namespace perikit::contract
