#pragma once
/// Start values that carry prescribed displacements into the body.

#include <functional>

#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

/// z <- M^-1 r on free components, M symmetric and positive definite; r and z are different fields.
using PreconditionerAction = std::function<void(ConstFieldView r, FieldView z)>;

/// Sets the prescribed components of equilibrium.displacement(). Where its free ones are extrapolated already they stay; else they move
/// by about K(u)^-1 (r(u) - K(u) w), w the change of the prescribed ones: conjugate gradients on tangent actions, preconditioned where
/// there is something for it, to 1 % or 300 iterations, ended where the tangent is not positive.
/// For solvers that would otherwise start from a torn rim. False where u or its tangent is inadmissible.
bool predict_by_tangent(Equilibrium& equilibrium, bool extrapolated, const PreconditionerAction& precondition = {});

}  // namespace perikit
