#pragma once
/// Bonds that weaken gradually, as part of the equations of equilibrium.

#include "perikit/core/evaluation_status.hpp"
#include "perikit/core/field.hpp"
#include "perikit/model/configuration.hpp"

namespace perikit {

/// Bonds weaken at equilibria, and equilibrium is found again with what is left of them. At the end b = b(u) for all of them, and
/// the forces f(u, b(u)) have the Jacobian of Hashim et al., eqs. 50-54,
///
///   J = -df/du - df/db db/du,
///
/// of which the first part is the tangent and the second one, which is not symmetric, is here. It tells how far bonds weaken in
/// the end (`weaken`); states are equilibria with bonds that do not change, as without it. On one rank.
class WeakeningBonds {
 public:
  virtual ~WeakeningBonds() = default;
  /// Whether bonds weakened at the last Problem::advance that `weaken` may let go on: their falls become smaller from one advance to the next. Falls
  /// that grow are a crack that runs, and where it ends no Jacobian can tell.
  virtual bool any() const = 0;
  /// Kw <- Kw - df/db (db/du . w) of these bonds at the displacement of that advance [N]: db/du by central differences of the criterion, df/db by
  /// a difference over 1e-6 in b. Criteria by energy: that energies also depend on b is left out. Not ok where displacements are inadmissible.
  virtual EvaluationStatus add_tangent(const Configuration& at, ConstFieldView w, FieldView Kw) = 0;
  /// The bonds of `any` weaken to what they are at displacements u + du, and to no less than half of what they were: none breaks by a forecast. Energies
  /// as after Problem::advance. True when some did.
  virtual bool weaken(const Configuration& at, ConstFieldView du) = 0;
};

}  // namespace perikit
