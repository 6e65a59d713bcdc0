#pragma once
/// Damage criteria: the integrity b of a bond, 1 intact and 0 broken, as a falling function of one value of the bond: its stretch
/// s = (|y| - |xi|)/|xi|, or what the criterion makes of its stretch, energy and stress.
///
/// A criterion names what it looks at, and nothing else is computed. The engine makes it irreversible and symmetric: b_ij is the
/// least value that the bond has had, the same for ij and ji, and it changes between steps (or converged load steps), never
/// inside an evaluation, so that force = -dE/du holds.

#include <cstddef>

#include "perikit/model/family_point.hpp"

namespace perikit {

/// What the value of a bond never exceeds: bonds with less of it than their limit need no look.
enum class ValueBound { none, energy, energy_over_share };

struct DamageTraits {
  bool bits = true;  ///< b is 1 or 0, never between: a bond needs one bit
  // What `measure` looks at beside the stretch. With neither, the value is the stretch and `measure` is not called.
  bool energy = false;  ///< BondStates::energy
  bool stress = false;  ///< BondStates::stress; not of pair laws, which have none
  ValueBound bound = ValueBound::none;
  /// `integrity` depends on value and limits alone, not on further parameters: bonds of an interface share it with those of the body.
  bool by_limits = false;
  /// BondStates::energy is not what the bond holds but what it would set free, dE/db_ij, where the engine knows that: with one gradient of
  /// order 1 per point, gradients of bonds, and weighted gradients of bonds, and not with `stress`. A `bound` then means: bonds are looked
  /// at where an evaluation point holds an eighth of what would be needed.
  bool released = false;
};

/// What the limits of a point's bonds may depend on.
struct DamagePoint : FamilyPoint {
  double mean_length = 0;  ///< <xi> = int omega xi^d / int omega xi^(d-1) over (0, delta), d the dimension [m]
  /// Bonds that cross a plane, per area: sum of xi.n V_j over the bonds of one side, xi.n > 0 [m^4 in 3D]. On lattices counted
  /// for a plane along the lattice, on clouds on the mean over all planes and whole families; far from the spacing pi delta^4/4
  /// in 3D, 2 h delta^3/3 in 2D, A delta^2/2 in 1D.
  double crossing = 0;
  double crossing_shares = 0;  ///< the same sum with BondStates::share of each bond
  /// <xi> as the bonds themselves have it, where their factors give every uniform strain its energy: what those that cross an area hold in an expansion, over what the
  /// integral has for each metre of <xi>. Counted as `crossing`; 0: by the integral [m].
  double counted_length = 0;
};

/// Arrays over n bonds that can be read up to padded(n); null where the traits do not ask for them.
struct BondStates {
  int n = 0;
  const double* length = nullptr;   ///< |xi| [m]
  const double* stretch = nullptr;  ///< s [-]
  /// What the bond stores in a homogeneous expansion of its family, relative to its other bonds: omega or 1 for kinematics with
  /// gradients, what the bond law says for pair laws.
  const double* share = nullptr;
  /// w_ij [J/m^6]: what both directions of the bond hold, without b, over V_i V_j. V_i V_j b w adds up to the stored energy
  /// (framework/docs/decisions/0014-what-bonds-hold.md).
  /// `released`: dE/db_ij over V_i V_j instead, with displacements held; may be below zero, and does not add up.
  const double* energy = nullptr;
  /// Cauchy stress of the bond's evaluation points, the mean of both ends: xx yy zz xy xz yz, stress[c * stride + k] [Pa].
  const double* stress = nullptr;
  std::size_t stride = 0;
  double* value = nullptr;  ///< to be compared with the limits; fully overwritten
};

/// b is 1 up to `onset` and 0 beyond `failure`; equal where bonds break at once. A bond has the limits of its weaker end; a limit of stretch
/// stands for the energy of the bond, so that between two materials the stiffness of the bond itself counts (BodyDamage::limits). Bonds of points
/// that must not fail have infinite limits.
struct DamageLimits {
  double onset = 0, failure = 0;
};

/// Arrays over n bonds that can be read and written up to padded(n).
struct IntegrityBatch {
  int n = 0;
  const double* value = nullptr;  ///< the stretch, or what `measure` made
  const double* onset = nullptr;  ///< limits of the bond
  const double* failure = nullptr;
  double* integrity = nullptr;  ///< b in [0, 1], fully overwritten
};

class Damage {
 public:
  virtual ~Damage() = default;
  virtual DamageTraits traits() const noexcept = 0;
  /// Limits at one point, 0 < onset <= failure; asked at set-up. Throws std::domain_error naming what is wrong.
  virtual DamageLimits limits(const DamagePoint&) const = 0;
  /// The value of each bond where the traits ask for more than the stretch: finite, and 0 at rest.
  virtual void measure(const BondStates&) const noexcept {}
  /// Never rises with the value; 1 for value <= onset, 0 for value > failure. Infinite limits never break.
  virtual void integrity(const IntegrityBatch&) const noexcept = 0;
};

}  // namespace perikit
