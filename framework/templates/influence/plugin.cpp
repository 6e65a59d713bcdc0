#include <cmath>
#include <memory>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: omega(r), r = |xi|/delta in (0, 1]; finite and not negative, and each value a function of its own r alone.
class PartName final : public InfluenceFunction {
 public:
  explicit PartName(double width) : width_(width) {}

  /// Default: a bell, exp(-(r/width)^2).
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    for (std::size_t k = 0; k < r.size(); ++k) omega[k] = std::exp(-(r[k] / width_) * (r[k] / width_));
  }

 private:
  double width_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.number("width", "-", "Width of the bell over the horizon.").by_default("0.5").positive();
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "part_name",
                       .summary = "one line: what it is",
                       .parameters = parameters(),
                       // Every example is built and tested by the contract suite.
                       .examples = {"", "width = 0.8"},
                       .equations = "omega = exp(-(r/width)^2)",
                       .source = "the paper, with the number of the equation",
                       .limits = "where it must not be used"},
                      [](const ParameterValues& values, const PartFactory&) { return std::make_unique<PartName>(values.number("width")); });
}
