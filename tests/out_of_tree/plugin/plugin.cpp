#include "perikit/sdk/plugin.hpp"

#include <algorithm>
#include <memory>

using namespace perikit;

namespace {
class Parabola final : public InfluenceFunction {
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    std::ranges::transform(r, omega.begin(), [](double s) { return 1.0 - s * s; });
  }
};
}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "parabola", .summary = "omega = 1 - r^2", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Parabola>(); });
}
