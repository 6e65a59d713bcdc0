#include <algorithm>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

class Cone final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    std::transform(r.begin(), r.end(), omega.begin(), [](double s) { return 1.0 - s; });
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "cone",
                       .summary = "falls linearly to zero at the horizon",
                       .parameters = {},
                       .examples = {""},
                       .equations = "omega = 1 - r",
                       .source = "a common choice of the field",
                       .limits = "bonds of length delta have no influence: horizon_ratio = 1 leaves a lattice without neighbours"},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Cone>(); });
}
