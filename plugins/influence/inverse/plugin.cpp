#include <algorithm>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

class Inverse final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    std::transform(r.begin(), r.end(), omega.begin(), [](double s) { return 1.0 / s; });
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "inverse",
                       .summary = "near bonds count more, as the inverse of the bond length",
                       .parameters = {},
                       .examples = {""},
                       .equations = "omega = 1/r = delta/|xi|",
                       .source = "S. A. Silling et al., Peridynamic states and constitutive modeling, J. Elasticity 88 (2007) 151-184",
                       .limits = "grows without bound for r -> 0: a cloud with nearly coincident points is dominated by them"},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Inverse>(); });
}
