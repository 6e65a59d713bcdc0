#include "setup/surfaces/first_moments.hpp"

#include <array>
#include <cmath>

#include "body/partition/near_ranks.hpp"
#include "core/symmetric_matrix.hpp"
#include "perikit/core/exact_sum.hpp"

namespace perikit {

void give_first_moments(const Body& body, std::span<const std::int32_t> points, const SurfaceSamples& samples, std::span<double> share) {
  const auto at = [&](std::size_t k) { return body.position(static_cast<std::size_t>(points[k])); };
  const auto over_shares = [&](auto&& visit) {
    for (std::size_t k = 0; k < points.size(); ++k)
      if (body.owns(static_cast<std::size_t>(points[k]))) visit(k, at(k));
  };
  ExactSum sizes;
  std::array<ExactSum, 3> middles;
  over_shares([&](std::size_t k, const Point& x) {
    sizes.add(std::abs(share[k]));
    for (std::size_t a = 0; a < 3; ++a) middles[a].add(std::abs(share[k]) * x[a]);
  });
  const double size = total_of(body, sizes);
  Point middle{};
  for (std::size_t a = 0; a < 3; ++a) middle[a] = size > 0 ? total_of(body, middles[a]) / size : 0.0;
  if (!(size > 0)) return;
  // In spacings from the middle of the shares, about which their first moments vanish: the sum and the moments are found apart.
  const auto from_middle = [&](const Point& x) {
    return std::array{(x[0] - middle[0]) / body.spacing(), (x[1] - middle[1]) / body.spacing(), (x[2] - middle[2]) / body.spacing()};
  };
  ExactSum missing_sum;
  std::array<ExactSum, 3> missing_moment;
  std::array<ExactSum, 9> spreads;
  over_shares([&](std::size_t k, const Point& x) {
    const auto r = from_middle(x);
    missing_sum.add(-share[k]);
    for (std::size_t a = 0; a < 3; ++a) {
      missing_moment[a].add(-share[k] * r[a]);
      for (std::size_t b = 0; b < 3; ++b) spreads[3 * a + b].add(std::abs(share[k]) * (r[a] * r[b]));
    }
  });
  for (std::size_t q = 0; q < samples.place.size(); ++q) {
    const auto r = from_middle(samples.place[q]);
    missing_sum.add(samples.weight[q]);
    for (std::size_t a = 0; a < 3; ++a) missing_moment[a].add(samples.weight[q] * r[a]);
  }
  const double sum = total_of(body, missing_sum) / size;
  std::array<double, 3> lack{}, slope{};
  std::array<double, 9> spread{};
  for (std::size_t a = 0; a < 3; ++a) lack[a] = total_of(body, missing_moment[a]);
  for (std::size_t k = 0; k < 9; ++k) spread[k] = total_of(body, spreads[k]);
  const SymmetricEigen axes(3, spread.data());
  for (int k = 0; k < 3; ++k) {
    if (!(axes.value(k) > 1e-6 * size)) continue;   // less than a thousandth of a spacing
    double along = 0;
    for (int a = 0; a < 3; ++a) along += axes.vector(a, k) * lack[static_cast<std::size_t>(a)] / axes.value(k);
    for (int a = 0; a < 3; ++a) slope[static_cast<std::size_t>(a)] += along * axes.vector(a, k);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto r = from_middle(at(k));
    share[k] += std::abs(share[k]) * (sum + slope[0] * r[0] + slope[1] * r[1] + slope[2] * r[2]);
  }
}

}  // namespace perikit
