#pragma once
/// The free surface in the eyes of a pair law.

#include <cstdint>
#include <memory>
#include <vector>

#include "perikit/core/field.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// Laws in which all points have the law of one record, but those that store nothing: images, and ghosts of other ranks.
class OneLaw {
 public:
  /// known: of the body, with regions.
  OneLaw(const Body& body, const Laws& known, MaterialRecord record);
  OneLaw(const OneLaw&) = delete;
  OneLaw& operator=(const OneLaw&) = delete;
  const Laws& laws() const noexcept { return *laws_; }

 private:
  std::vector<std::uint16_t> ids_;   ///< which the laws look at
  std::unique_ptr<const Laws> laws_;
};

/// The area vectors of points [m^2]: minus their internal forces in a uniform strain, over the stress that the bonds have there inside of the body. axis: of a
/// stress along it alone; -1: the same stress along all axes. They vanish inside, sum to zero to rounding, and loads in proportion to them hold that
/// strain in equilibrium, point by point. The law has the constants of [material] everywhere: of these only Poisson's ratio counts. All ranks must call it.
Field pair_areas(TermParts parts, int axis);

}  // namespace perikit
