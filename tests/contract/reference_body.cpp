#include "tests/contract/reference_body.hpp"

namespace perikit::contract {

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
  constexpr double youngs = 2.0, poisson = 0.3;   // of BodyOptions
  constexpr double lambda = youngs * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = youngs / (2 * (1 + poisson));
  switch (body.space()) {
    case Space::plane_stress: return {2 * lambda * mu / (lambda + 2 * mu), mu, body.section()};
    case Space::line_stress: return {youngs - 2 * mu, mu, body.section()};
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

}  // namespace perikit::contract
