// Bonds that weaken from one equilibrium to the next, for those who forecast how far: their part of the Jacobian, and what they come to.
#include <algorithm>
#include <cmath>
#include <limits>

#include "fracture/fracture.hpp"
#include "perikit/core/field_operations.hpp"
#include "terms/terms.hpp"

namespace perikit {

std::vector<double> Fracture::integrities(std::span<const BondId> bonds, const Configuration& at) {
  const std::size_t size = padded(bonds.size());
  AlignedVector<double> value(size, 0.0), onset(size, 1.0), failure(size, 1.0), left(size, 1.0);
  finder_->values(bonds, at, {value.data(), bonds.size()});
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const DamageLimits limits = damage_->limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    onset[k] = limits.onset;
    failure[k] = limits.failure;
  }
  damage_->law->integrity({static_cast<int>(bonds.size()), value.data(), onset.data(), failure.data(), left.data()});
  return {left.begin(), left.begin() + static_cast<std::ptrdiff_t>(bonds.size())};
}

bool Fracture::add_weakening(const Configuration& at, ConstFieldView w, FieldView force) {
  const double length = largest_magnitude(w);
  if (weakening_.empty() || length < std::numeric_limits<double>::min()) return true;   // the step would be infinite
  // Central differences: points move by the cube root of the rounding unit times the spacing.
  const double step = std::cbrt(std::numeric_limits<double>::epsilon()) * families_.body().spacing() / length;
  const ConstFieldView u = at.u();
  Field beside = families_.body().make_field(u.components);
  combine(1, u, step, w, beside);
  std::vector<double> slope = integrities(weakening_, at.moved_to(beside));
  combine(1, u, -step, w, beside);
  const std::vector<double> behind = integrities(weakening_, at.moved_to(beside));
  double largest = 0;
  for (std::size_t k = 0; k < slope.size(); ++k) {
    slope[k] = (slope[k] - behind[k]) / (2 * step);
    largest = std::max(largest, std::abs(slope[k]));
  }
  if (largest < std::numeric_limits<double>::min()) return true;
  const double change = 1e-6 / largest;
  std::vector<BondChange> before, after;
  for (std::size_t k = 0; k < slope.size(); ++k) {
    const double b = families_.integrity(weakening_[k]);
    if (b == 0) continue;
    before.push_back({weakening_[k], b});
    after.push_back({weakening_[k], std::clamp(b + change * slope[k], 0.5 * b, 1.0)});
  }
  if (before.empty()) return true;
  std::vector<std::int32_t> ends;
  for (const BondChange& bond : before) ends.insert(ends.end(), {bond.bond.point, bond.bond.far});
  const MarkedRegion region = dependent_on(ends);
  const bool known = std::isfinite(terms_.add_forces(at, region, -1 / change, force));
  bonds_changed(families_.lower(after));
  const bool still = std::isfinite(terms_.add_forces(at, region, 1 / change, force));
  bonds_changed(families_.raise(before));
  return known && still;
}

BondUpdate Fracture::weaken(const Configuration& at, ConstFieldView forecast) {
  const std::vector<double> ahead = integrities(settling_, at.moved_to(forecast));
  changes_.clear();
  for (std::size_t k = 0; k < settling_.size(); ++k) {
    const double now = families_.integrity(settling_[k]), then = std::max(ahead[k], AitkenAcceleration::least_left * now);
    if (then < now) changes_.push_back({settling_[k], then});
  }
  BondUpdate update;
  if (changes_.empty()) return update;
  let_fail(found({}, at), at, {}, update);
  finish(update);
  return update;
}

}  // namespace perikit
