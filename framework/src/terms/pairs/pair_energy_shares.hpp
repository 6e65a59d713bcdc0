#pragma once
#include "perikit/model/kinematics.hpp"

namespace perikit {

/// What n bonds of a pair law store in a homogeneous expansion of their family, relative to each other, from arrays that can be read up to padded(n);
/// share is written so far too.
void pair_energy_shares(const PairKinematics& law, int n, const double* length, const double* omega, double* share) noexcept;

}  // namespace perikit
