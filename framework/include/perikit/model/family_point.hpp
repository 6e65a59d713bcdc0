#pragma once
/// A point and its family as the constants of laws between points see them.

#include <cmath>
#include <numbers>

#include "perikit/core/space.hpp"
#include "perikit/model/material.hpp"

namespace perikit {

struct FamilyPoint {
  Space space = Space::solid;
  double section = 1;                 ///< thickness (2D) [m] or area (1D) [m^2], contained in the volumes
  double horizon = 0;                 ///< delta [m]
  Moduli moduli;                      ///< small strain of the point's material [Pa]

  /// Bulk modulus as the space sees it: K; plane strain K + mu/3, plane stress E/(2(1 - nu)); uniaxial strain lambda + 2 mu, stress E.
  double bulk() const noexcept {
    switch (space) {
      case Space::solid: return moduli.bulk();
      case Space::plane_strain: return moduli.lambda + moduli.mu;
      case Space::plane_stress: return moduli.youngs() / (2 * (1 - moduli.poisson()));
      case Space::line_strain: return moduli.lambda + 2 * moduli.mu;
      case Space::line_stress: return moduli.youngs();
    }
    return 0;
  }
  /// lambda in sigma = lambda tr(e) I + 2 mu e with tensors of the space's dimension (plane and line stress: condensed) [Pa].
  double lame_lambda() const noexcept { return bulk() - 2 * moduli.mu / dimension(space); }
  /// Stiffness of bond-based springs [Silling, Askari 2005]: 18 K/(pi delta^4), 12 k'/(pi h delta^3), 2 E/(A delta^2) [N/m^6].
  double micromodulus() const noexcept {
    constexpr double pi = std::numbers::pi;
    switch (dimension(space)) {
      case 3: return 18 * bulk() / (pi * std::pow(horizon, 4));
      case 2: return 12 * bulk() / (pi * section * std::pow(horizon, 3));
      default: return 2 * bulk() / (section * std::pow(horizon, 2));
    }
  }
};

}  // namespace perikit
