#include "perikit/problem/surface_rule.hpp"

#include <algorithm>
#include <cmath>

#include "body/partition/near_ranks.hpp"

namespace perikit {

std::int32_t add_cell(int dimension, int axis, const Point& centre, double side, double share, SurfaceSamples& samples) {
  const double step = side / (2 * std::sqrt(3.0));
  const int count = 1 << (dimension - 1);
  for (int n = 0; n < count; ++n) {
    Point x = centre;
    for (int a = 0, bit = 0; a < dimension; ++a)
      if (a != axis) x[static_cast<std::size_t>(a)] += n >> bit++ & 1 ? step : -step;
    samples.place.push_back(x);
    samples.weight.push_back(share / count);
  }
  return samples.end_group();
}

SurfaceRule::SurfaceRule(const Body& body, std::vector<std::int32_t> points, std::vector<double> share, SurfaceSamples samples)
    : body_(&body), points_(std::move(points)), share_(std::move(share)), samples_(std::move(samples)) {
  used_.resize(samples_.first.size() - 1, false);
  for (std::size_t g = 0; g < used_.size(); ++g) used_[g] = samples_.weight[samples_.first[g]] != 0;
  for (std::size_t k = 0; k < points_.size(); ++k)
    if (share_[k] != 0) used_[static_cast<std::size_t>(samples_.group[k])] = true;
  const auto owned = [&](std::size_t k) { return body.owns(static_cast<std::size_t>(points_[k])); };
  const auto at = [&](std::size_t k) { return body.position(static_cast<std::size_t>(points_[k])); };
  std::array<ExactSum, size> middle;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (!owned(k)) continue;
    const double weight = std::abs(share_[k]);
    middle[0].add(weight);
    for (std::size_t a = 0; a < 3; ++a) middle[a + 1].add(weight * at(k)[a]);
  }
  const double total = total_of(body, middle[0]);
  for (std::size_t a = 0; a < 3; ++a) origin_[a] = total > 0 ? total_of(body, middle[a + 1]) / total : 0.0;

  std::array<std::array<ExactSum, size>, size> gram;
  std::array<ExactSum, size> lack;
  ExactSum area;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (!owned(k)) continue;
    const Moments phi = basis(at(k));
    for (std::size_t i = 0; i < size; ++i) {
      lack[i].add(-share_[k] * phi[i]);
      for (std::size_t j = 0; j <= i; ++j) gram[i][j].add(std::abs(share_[k]) * (phi[i] * phi[j]));
    }
  }
  for (std::size_t q = 0; q < samples_.place.size(); ++q) {
    if (samples_.weight[q] == 0) continue;
    const Moments phi = basis(samples_.place[q]);
    for (std::size_t i = 0; i < size; ++i) lack[i].add(samples_.weight[q] * phi[i]);
    area.add(std::abs(samples_.weight[q]));
  }
  area_ = total_of(body, area);
  for (std::size_t i = 0; i < size; ++i) {
    uniform_[i] = total_of(body, lack[i]);
    for (std::size_t j = 0; j <= i; ++j) factors_[i][j] = total_of(body, gram[i][j]);
  }
  // Lengths are in spacings: a direction along which the points spread less than a thousandth of one is left out.
  const double least = 1e-6 * factors_[0][0];
  for (std::size_t j = 0; j < size; ++j) {
    for (std::size_t k = 0; k < j; ++k) factors_[j][j] -= factors_[j][k] * factors_[j][k] * factors_[k][k];
    if (!(factors_[j][j] > least)) factors_[j][j] = 0;
    for (std::size_t i = j + 1; i < size; ++i) {
      for (std::size_t k = 0; k < j; ++k) factors_[i][j] -= factors_[i][k] * factors_[j][k] * factors_[k][k];
      factors_[i][j] = factors_[j][j] > 0 ? factors_[i][j] / factors_[j][j] : 0;
    }
  }
}

SurfaceRule::Moments SurfaceRule::basis(const Point& x) const {
  const double unit = body_->spacing();
  return {1, (x[0] - origin_[0]) / unit, (x[1] - origin_[1]) / unit, (x[2] - origin_[2]) / unit};
}

SurfaceRule::Moments SurfaceRule::solve(Moments c) const {
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t k = 0; k < i; ++k) c[i] -= factors_[i][k] * c[k];
  for (std::size_t i = 0; i < size; ++i) c[i] = factors_[i][i] > 0 ? c[i] / factors_[i][i] : 0;
  for (std::size_t i = size; i-- > 0;)
    for (std::size_t k = i + 1; k < size; ++k) c[i] -= factors_[k][i] * c[k];
  return c;
}

std::vector<double> SurfaceRule::forces(const SpaceTimeFunction& value, double t) const {
  std::vector<double> forces(points_.size());
  if (!value.depends_on_position) {
    const double everywhere = value({}, t);
    std::ranges::transform(share_, forces.begin(), [&](double share) { return share * everywhere; });
    return forces;
  }
  std::array<ExactSum, size> lack;
  ExactSum mean;
  std::vector<double> traction(samples_.first.size() - 1);
  for (std::size_t g = 0; g < traction.size(); ++g) {
    if (!used_[g]) continue;
    for (std::size_t q = samples_.first[g]; q < samples_.first[g + 1]; ++q) {
      const double here = value(samples_.place[q], t);
      traction[g] += here;
      if (samples_.weight[q] == 0) continue;
      const Moments phi = basis(samples_.place[q]);
      for (std::size_t i = 0; i < size; ++i) lack[i].add(samples_.weight[q] * phi[i] * here);
      mean.add(std::abs(samples_.weight[q]) * here);
    }
    traction[g] /= static_cast<double>(samples_.first[g + 1] - samples_.first[g]);
  }
  for (std::size_t k = 0; k < points_.size(); ++k) {
    forces[k] = share_[k] * traction[static_cast<std::size_t>(samples_.group[k])];
    if (!body_->owns(static_cast<std::size_t>(points_[k]))) continue;
    const Moments phi = basis(body_->position(static_cast<std::size_t>(points_[k])));
    for (std::size_t i = 0; i < size; ++i) lack[i].add(-forces[k] * phi[i]);
  }
  if (!(area_ > 0)) return forces;   // no face across this axis: nothing to compare with
  Moments c;
  const double uniform = total_of(*body_, mean) / area_;
  for (std::size_t i = 0; i < size; ++i) c[i] = total_of(*body_, lack[i]) - uniform * uniform_[i];
  c = solve(c);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Moments phi = basis(body_->position(static_cast<std::size_t>(points_[k])));
    double change = 0;
    for (std::size_t i = 0; i < size; ++i) change += c[i] * phi[i];
    forces[k] += std::abs(share_[k]) * change;
  }
  return forces;
}

}  // namespace perikit
