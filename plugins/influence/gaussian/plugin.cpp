#include <algorithm>
#include <cmath>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

class Gaussian final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    std::transform(r.begin(), r.end(), omega.begin(), [](double s) { return std::exp(-s * s); });
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "gaussian",
                       .summary = "Gaussian bell, 1/e at the horizon",
                       .parameters = {},
                       .examples = {""},
                       .equations = "omega = exp(-r^2) = exp(-|xi|^2/delta^2)",
                       .source = "Scabbia et al., Peridynamic correspondence model for nearly-incompressible finite elasticity",
                       .limits = "does not vanish at the horizon; `expression` has narrower bells: exp(-9*r^2)"},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Gaussian>(); });
}
