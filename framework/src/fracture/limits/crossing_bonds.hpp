#pragma once
/// Counting the bonds that cross a plane.

#include "body/partition/partition.hpp"
#include "families/families.hpp"
#include "fracture/search/bond_energy_split.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

/// Bonds that cross a unit of area: sum of xi.n V_j over the bonds xi of a whole family with xi.n > 0, n normal to the plane,
/// plain and with the share of each bond (BondStates::share). pi delta^4/4, 2 h delta^3/3, A delta^2/2 in the limit of a fine
/// body, plain.
struct CrossingBonds {
  double plain = 0, shares = 0;
  double of_family = 0;   ///< sum of share V_j over a whole family: such bonds hold 2 psi shares/of_family per area, psi the energy density of an expansion
};

/// Half of the mean of |cos| over all directions: 1/4 in 3D, 1/pi in 2D, 1/2 in 1D.
double half_mean_cosine(int dimension) noexcept;

/// On a lattice without jitter, for a plane along the lattice: the weakest. Else the mean over all planes and over the points with whole families, which
/// no surface cuts; in thin bodies over those with points on all sides; of a lattice of the same spacing where there is no such point. partition: null
/// where one rank has the whole body; images: null where the body has none. All ranks must call it.
CrossingBonds crossing_bonds(const Families& families, const EnergyShares& energy_shares, const Partition* partition = nullptr, const ImageMap* images = nullptr);

}  // namespace perikit
