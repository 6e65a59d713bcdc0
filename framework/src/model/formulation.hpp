#pragma once
/// A kinematics as the engine sees it: taken apart once, at set-up.

#include <memory>

#include "perikit/model/kinematics.hpp"

namespace perikit {

/// Exactly one of the four pointers is not null. What a class does not state keeps the value given here.
struct Formulation {
  std::shared_ptr<const Kinematics> kinematics;   ///< keeps what the pointers show alive
  const PointKinematics* point = nullptr;
  const BondKinematics* bond = nullptr;
  const WeightedKinematics* weighted = nullptr;
  const PairKinematics* pairs = nullptr;
  GradientMap map = GradientMap::identity;
  int order = 1;         ///< of the point gradient
  double far_share = 0;  ///< s of A_b = (1 - s) Hbar_i + s Hbar_j
  BondWeight weight = BondWeight::volume;
  bool pair_symmetric = false, g_from_xi_only = false;
  PartWeight part_weight = PartWeight::equal;
  ForceState force_state = ForceState::variational;
  double cell = 0;       ///< width of the cells whose second moments count, point gradients of orders above 1 on lattices [m]; 0: none
  PairTraits pair_traits;
  const DilatationLaw* dilatation = nullptr;      ///< pairs: null where phi is zero

  bool selective() const noexcept { return map == GradientMap::selective; }
  /// Evaluation points per point of a body of this dimension; 0: one per bond, or none at all (pairs). Throws InputError where the
  /// kinematics does.
  int parts(int dimension) const { return weighted ? weighted->parts(dimension) : point ? (cell > 0 ? 2 * dimension : 1) : 0; }
  /// Whether evaluation points have stencils of their own, other than the gradient of a point.
  bool own_stencils() const noexcept { return weighted || cell > 0; }
};

/// Throws std::invalid_argument for an object that is none of the four classes or several of them, and for a map over anything but a
/// BondKinematics or a WeightedKinematics.
Formulation make_formulation(std::shared_ptr<const Kinematics> kinematics);

}  // namespace perikit
