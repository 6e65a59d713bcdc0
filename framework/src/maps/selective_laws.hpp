#pragma once
/// The selective map of laws whose stress at every mapped gradient Fh = a Ft follows from one evaluation at Ft: what the ends of a bond
/// say differs by scalars. Names as in selective_map.hpp.

#include "maps/selective_map.hpp"

namespace perikit {

/// Laws psi = psi_iso(J^(-1/3) F) + U(J) feel of the map the volumes alone: with Jh = a^3 Jt, tau = Jh U'(Jh) and m = a - 1 + c,
///   dpsi/dFt = P_iso(Ft) + tau (1 - m/a) Ft^-T,   p/3 = tau m/a.
/// Where c = 1 throughout (volume.whole), Jh is Jbar and m is a: nothing depends on Jt.
///
/// j <- Jh - 1 by end. Fills in.growth and in.inverse where shares are not whole.
void mapped_volumes(Space space, const SelectiveBatch& in, double* j) noexcept;

/// What becomes of the stresses.
struct VolumetricStress {
  double sign;              ///< of the result
  const double* weight[2];  ///< W of each end by lane
  const double* kirchhoff;  ///< tau by end
  const double* slope;      ///< J dtau/dJ by end; null: no tangent
  double* S;                ///< P_iso(Ft) (tangent: A_iso : dFt); see below
  double* pressure;         ///< W p/3 by end
  double* pressure_rate;    ///< W dp/3 by end; tangent only
};

/// After mapped_volumes. S <- sum over ends of W dpsi/dFt (tangent: of its derivative) unless shares are whole: then false, and it is S times
/// the sum of W.
bool volumetric_pull_back(Space space, const SelectiveBatch& in, const VolumetricStress& stress) noexcept;

/// Laws that are linear in the Green strain E (MaterialTraits::green_linear): with e = (a^2 - 1)/2 and kappa the bulk modulus
///   a P(a F) = alpha P(F) + beta F,   alpha = a^4,   beta = 3 kappa a^2 e,   psi(a F) = alpha psi(F) + 3 kappa e (a^2 tr E + 3/2 e).
///
/// Fills in.growth and in.inverse.
void find_growths(Space space, const SelectiveBatch& in) noexcept;
/// After find_growths. psi: in psi(Ft) by lane, out psi(Fh) by end.
void map_energies(Space space, const SelectiveBatch& in, double kappa, double* psi) noexcept;
/// After find_growths, with stress.P and dP those of Ft (A : dFt), by lane.
void green_pull_back(Space space, const SelectiveBatch& in, double kappa, const SelectiveStress& stress) noexcept;

}  // namespace perikit
