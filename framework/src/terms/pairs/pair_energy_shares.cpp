#include "terms/pairs/pair_energy_shares.hpp"

#include <algorithm>

#include "perikit/operators/laws.hpp"

namespace perikit {

/// From the bond law at a small stretch; where it has a dilatation, bonds share that in proportion too.
void pair_energy_shares(const PairKinematics& law, int n, const double* length, const double* omega, double* share) noexcept {
  constexpr double s = 1e-6;
  alignas(64) double extension[batch_points], modulus[batch_points];
  std::fill(std::begin(modulus), std::end(modulus), 1.0);
  for (int first = 0; first < n; first += batch_points) {
    const int count = std::min(batch_points, n - first), lanes = static_cast<int>(padded(static_cast<std::size_t>(count)));
    for (int k = 0; k < lanes; ++k) extension[k] = s * length[first + k];
    law.bond_law({count, length + first, omega + first, extension, modulus, share + first, nullptr, nullptr});
    for (int k = 0; k < lanes; ++k) share[first + k] *= 2 / (s * s);
  }
}

}  // namespace perikit
