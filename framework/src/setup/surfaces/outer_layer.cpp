#include "setup/surfaces/outer_layer.hpp"

#include <array>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"

namespace perikit {

OuterLayer outer_layer(double spacing, bool shared, const LayerPoints& visit) {
  constexpr double thick = 0.05, apart = 0.4, behind = 1.75;  // spacings
  std::array<ExactSum, 4> sums;  // volumes and numbers of the points of both
  double between = 0;
  visit([&](double depth, double volume) {
    depth /= spacing;
    if (depth > behind) return;
    if (depth > thick && depth < apart) between = 1;
    const std::size_t layer = depth <= thick ? 0 : 2;
    sums[layer].add(volume);
    sums[layer + 1].add(1);
  });
  std::array<double, 4> total{};
  for (std::size_t k = 0; k < total.size(); ++k) total[k] = shared ? total_over_ranks(sums[k]) : sums[k].value();
  const auto mean = [&](std::size_t k) { return total[k + 1] > 0 ? total[k] / total[k + 1] : 0.0; };
  return {mean(0), mean(2), (shared ? communicator().largest(between) : between) > 0};
}

}  // namespace perikit
