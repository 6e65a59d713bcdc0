#include "stretch_watch.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

namespace {

constexpr double shortest = 4, longest = 32;   // steps from look to look
/// Eigenvalues rise at most about as the fourth power of a stretch (tension of a Saint Venant-Kirchhoff solid: the third; compression of laws
/// with a logarithm of J: the third). Half of what is left then serves what happens between two looks.
constexpr double power = 8;
/// Of the margin: below it, an estimate tells nothing.
constexpr double least_margin = 0.01;

}  // namespace

void StretchWatch::estimated(StretchRange range, std::int64_t step, double headroom) {
  least_ = range.least;
  largest_ = range.largest;
  margin_ = std::max(least_margin, std::log(std::max(1.0, headroom)) / power);
  before_ = 0;
  last_ = static_cast<double>(step);
  next_ = static_cast<double>(step) + shortest;
}

bool StretchWatch::look(StretchRange range, std::int64_t step) {
  const double changed = std::max(std::log(range.largest / largest_), std::log(least_ / range.least));
  if (!(changed < margin_)) return true;
  // Half of the steps after which it is reached if it goes on like that.
  const double now = static_cast<double>(step), rate = (changed - before_) / (now - last_);
  const double steps = rate > 0 ? 0.5 * (margin_ - changed) / rate : longest;
  next_ = now + std::floor(std::clamp(steps, shortest, longest));
  last_ = now;
  before_ = changed;
  return false;
}

}  // namespace perikit
