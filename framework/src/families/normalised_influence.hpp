#pragma once
/// Influence functions without their factor. Families hold influence in this form alone, so that whatever looks at bonds (weights, limits of
/// damage, shares of energy, assembly) sees the same omega, and no result can depend on a constant factor.

#include <memory>

#include "perikit/body/influence.hpp"

namespace perikit {

/// The largest of the values at 64 equal steps in (0, 1]; 0 where none of them is positive.
double largest_influence(const InfluenceFunction& influence);

/// omega over `largest_influence`; omega itself where that is 0.
std::shared_ptr<const InfluenceFunction> normalised(std::shared_ptr<const InfluenceFunction> influence);

}  // namespace perikit
