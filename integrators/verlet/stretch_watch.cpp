#include "stretch_watch.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

namespace {

constexpr double shortest = 4, longest = 32;   // steps from look to look
/// Eigenvalues rise at most about as the fourth power of a stretch (tension of a Saint Venant-Kirchhoff solid: the third; compression of laws
/// with a logarithm of J: the third). Half of what may be left then serves what happens between two looks.
constexpr double least_power = 1, largest_power = 8;
/// Below it the last stretches left the eigenvalue nearly as it was: it rose by less than their square root.
constexpr double steady_power = 2;
/// Ritz values with such a bound have converged: they are off by much less.
constexpr double exact = 1.03;
/// What is left of the speed of stretches at each look, where they are slower then.
constexpr double of_late = 0.7;
/// An estimate after less tells nothing.
constexpr double least_margin = 0.01;

}  // namespace

double StretchWatch::change(StretchRange range) const {
  return std::max({0.0, std::log(range.largest / largest_), std::log(least_ / range.least)});
}

void StretchWatch::estimated(StretchRange range, std::int64_t step, EigenvalueBounds eigenvalue, double tolerated) {
  // What the last change did to the eigenvalue, the next one does about once more. A Ritz value lies below the eigenvalue: one that had not converged then
  // makes the rise larger than it was, one that has not converged now says nothing of it.
  const bool known = eigenvalue_ > 0 && eigenvalue.bound <= exact * eigenvalue.ritz;
  const double changed = known ? change(range) : 0;
  if (changed >= least_margin) power_ = std::clamp(2 * std::log(eigenvalue.ritz / eigenvalue_) / changed + 1, least_power, largest_power);
  if (power_ == 0) power_ = largest_power;
  least_ = range.least;
  largest_ = range.largest;
  eigenvalue_ = eigenvalue.ritz;
  margin_ = eigenvalue.bound > 0 ? std::max(least_margin, std::log(std::max(1.0, tolerated / eigenvalue.bound)) / power_) : least_margin;
  seen_least_ = range.least;
  seen_largest_ = range.largest;
  last_ = static_cast<double>(step);
  next_ = last_ + shortest;
}

double StretchWatch::enough(double tolerated) const { return power_ > 0 && power_ < steady_power ? std::sqrt(eigenvalue_ * tolerated) : 0; }

bool StretchWatch::look(StretchRange range, std::int64_t step) {
  const double changed = change(range);
  if (changed >= margin_) return true;
  // Half of the steps after which it is reached as fast as stretches have changed of late, up or down: bodies swing, and what falls rises again.
  const double now = static_cast<double>(step), moved = std::max(std::abs(std::log(range.largest / seen_largest_)), std::abs(std::log(range.least / seen_least_)));
  fastest_ = std::max(moved / (now - last_), of_late * fastest_);
  const double steps = fastest_ > 0 ? 0.5 * (margin_ - changed) / fastest_ : longest;
  next_ = now + std::floor(std::clamp(steps, shortest, longest));
  last_ = now;
  seen_least_ = range.least;
  seen_largest_ = range.largest;
  return false;
}

}  // namespace perikit
