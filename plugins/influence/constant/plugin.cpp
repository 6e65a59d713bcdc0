#include <algorithm>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

class Constant final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double>, std::span<double> omega) const override {
    std::fill(omega.begin(), omega.end(), 1.0);
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "constant",
                       .summary = "every bond of a family counts alike",
                       .parameters = {},
                       .examples = {""},
                       .equations = "omega = 1",
                       .source = "Chowdhury et al., A simple alteration of the peridynamics correspondence principle",
                       .limits = "jumps to zero at the horizon: families of an irregular cloud differ more than with a fading function"},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Constant>(); });
}
