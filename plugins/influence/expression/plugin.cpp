#include <fmt/format.h>
#include <muParser.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <string>

#include "perikit/influence.hpp"

using namespace perikit;

namespace {

/// muParser reads r from one place, so that an evaluation holds the lock.
class Formula final : public InfluenceFunction {
 public:
  explicit Formula(const ParameterValues& values) {
    const std::string& text = values.text("formula");
    parser_.ClearConst();
    parser_.DefineConst("pi", std::numbers::pi);
    parser_.DefineFun("floor", +[](double v) { return std::floor(v); });
    parser_.DefineFun("ceil", +[](double v) { return std::ceil(v); });
    parser_.DefineFun("pow", +[](double a, double b) { return std::pow(a, b); });
    parser_.DefineVar("r", &r_);
    try {
      parser_.SetExpr(text);
      if (const std::string fault = find_fault(); !fault.empty()) throw values.error("formula", fmt::format("found \"{}\": {}", text, fault));
    } catch (const mu::ParserError& error) {
      throw values.error("formula", fmt::format("found \"{}\": {}; allowed: an expression in r = |xi|/horizon such as exp(-9*r^2)",
                                                text, error.GetMsg()));
    }
  }

  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    const std::lock_guard lock(mutex_);
    for (std::size_t k = 0; k < r.size(); ++k) {
      r_ = r[k];
      const double value = parser_.Eval();
      omega[k] = value > 0.0 && std::isfinite(value) ? value : 0.0;  // samples cannot see every fault
    }
  }

 private:
  /// What is wrong with the formula on samples of (0, 1]; empty when nothing is.
  std::string find_fault() const {
    constexpr int samples = 1000;
    bool positive = false;
    for (int k = 1; k <= samples; ++k) {
      const double r = static_cast<double>(k) / samples;
      r_ = r;
      const double value = parser_.Eval();
      if (parser_.GetNumResults() != 1) return fmt::format("it has {} values; allowed: one", parser_.GetNumResults());
      if (r_ != r) return "it assigns to r; allowed: comparisons, which are written ==, <= or >=";
      if (!std::isfinite(value) || value < 0.0) return fmt::format("it is {} at r = {}; allowed: finite values >= 0 on (0, 1]", value, r);
      positive |= value > 0.0;
    }
    return positive ? "" : "it is zero for every r in (0, 1]; allowed: a function that is positive somewhere";
  }

  mutable std::mutex mutex_;
  mutable double r_ = 1.0;
  mu::Parser parser_;
};

PartDescription description() {
  PartDescription part{.name = "expression",
                       .summary = "any function of r, given as a formula",
                       .parameters = {},
                       .examples = {"formula = \"exp(-9*r^2)\"", "formula = \"(1 - r)^2\""},
                       .equations = "omega = formula(r), r = |xi|/delta in (0, 1]",
                       .source = "the operators and functions of all expressions, framework/docs/expressions.md; pi, no [constants]",
                       .limits = "must be finite and >= 0 on (0, 1] (checked at 1000 values of r); set-up of a large cloud is slower "
                                 "than with a built-in function"};
  part.parameters.string("formula", "the influence as an expression in r = |xi|/horizon").require();
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.influence(description(), [](const ParameterValues& values, const PartFactory&) { return std::make_unique<Formula>(values); });
}
