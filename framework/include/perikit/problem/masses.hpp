#pragma once
/// Masses of points, computed when asked for: runs without inertia need no densities.

#include <optional>
#include <span>

#include "perikit/body/body.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

class Masses {
 public:
  /// missing: what to throw where masses are asked for, as a density is missing. Body and laws must outlive the masses.
  Masses(const Body& body, const Laws& laws, std::optional<InputError> missing = std::nullopt);

  /// [kg], one component, 0 at dead points and ghosts. Throws InputError where a density is missing.
  std::span<const double> by_point() const;
  /// The mass that all points share, or 0 where they differ; lets a kernel skip reading them.
  double uniform() const;
  std::size_t bytes() const noexcept { return masses_.size() * sizeof(double); }

 private:
  const Body* body_;
  const Laws* laws_;
  std::optional<InputError> missing_;
  mutable AlignedVector<double> masses_;
};

}  // namespace perikit
