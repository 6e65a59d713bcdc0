#include "perikit/problem/masses.hpp"

#include <algorithm>

namespace perikit {

Masses::Masses(const Body& body, const Laws& laws, std::optional<InputError> missing)
    : body_(&body), laws_(&laws), missing_(std::move(missing)) {}

std::span<const double> Masses::by_point() const {
  if (missing_) throw *missing_;
  if (masses_.empty()) {
    masses_.assign(body_->stride(), 0.0);
    for (const std::int32_t index : body_->owned()) {
      const auto p = static_cast<std::size_t>(index);
      masses_[p] = laws_->density(p) * body_->volume(p);
    }
  }
  return masses_;
}

double Masses::uniform() const {
  const std::span<const double> masses = by_point();
  const double first = masses[static_cast<std::size_t>(body_->internal().front())];
  const bool same =
      std::ranges::all_of(body_->internal(), [&](std::int32_t p) { return masses[static_cast<std::size_t>(p)] == first; });
  return same ? first : 0.0;
}

}  // namespace perikit
