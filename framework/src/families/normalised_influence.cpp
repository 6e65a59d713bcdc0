#include "families/normalised_influence.hpp"

#include <algorithm>
#include <array>

namespace perikit {

namespace {

class NormalisedInfluence final : public InfluenceFunction {
 public:
  NormalisedInfluence(std::shared_ptr<const InfluenceFunction> influence, double largest) : influence_(std::move(influence)), largest_(largest) {}

  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    influence_->evaluate(r, omega);
    for (double& value : omega) value /= largest_;
  }

 private:
  std::shared_ptr<const InfluenceFunction> influence_;
  double largest_;
};

}  // namespace

double largest_influence(const InfluenceFunction& influence) {
  std::array<double, 64> r, omega;
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = static_cast<double>(k + 1) / static_cast<double>(r.size());
  influence.evaluate(r, omega);
  return std::max(0.0, std::ranges::max(omega));
}

std::shared_ptr<const InfluenceFunction> normalised(std::shared_ptr<const InfluenceFunction> influence) {
  const double largest = largest_influence(*influence);
  if (!(largest > 0)) return influence;
  return std::make_shared<NormalisedInfluence>(std::move(influence), largest);
}

}  // namespace perikit
