#include <algorithm>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {
struct One final : InfluenceFunction {
  void evaluate(std::span<const double>, std::span<double> omega) const override { std::ranges::fill(omega, 1.0); }
};
}  // namespace

/// A sound library; its copies and halves are the material of the tests.
PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "sound", .summary = "omega = 1", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<One>(); });
}
