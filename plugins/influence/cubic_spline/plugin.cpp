#include <algorithm>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

class CubicSpline final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    std::transform(r.begin(), r.end(), omega.begin(), [](double s) {
      const double rest = 1.0 - s;
      return s <= 0.5 ? 1.0 - 6.0 * s * s * rest : 2.0 * rest * rest * rest;
    });
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "cubic_spline",
                       .summary = "cubic B-spline, twice differentiable, zero at the horizon",
                       .parameters = {},
                       .examples = {""},
                       .equations = "omega = 1 - 6 r^2 + 6 r^3   for r <= 1/2\nomega = 2 (1 - r)^3         for 1/2 < r <= 1",
                       .source = "Partmann et al., Local continuum consistent peridynamics, GAMM-Mitteilungen 49 (2026) e70014, eq. 4.35 "
                                 "without its constant factor",
                       .limits = "bonds of length delta have no influence: needs a horizon_ratio well above 1 (2 and more in practice)"},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<CubicSpline>(); });
}
