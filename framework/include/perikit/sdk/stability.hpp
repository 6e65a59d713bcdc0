#pragma once
/// Whether an equilibrium is stable.

#include "perikit/sdk/tangent_predictor.hpp"

namespace perikit {

/// True where conjugate gradients on the tangent at u meet a motion w of the free points with w . K w < 0 by more than rounding: the energy of body and
/// loads falls along it, and the equilibrium u is unstable. They start from noise, in which every motion has a part, and end where the residual has become
/// smaller than that part, which it does not before they have met the lowest modes, or after `most` iterations. False where K is positive, semidefinite, or
/// nothing was found by then; without a look where K is constant (Problem::constant_stiffness) and loads do not follow. Of following loads, whose K is not
/// symmetric, the symmetric part decides. All ranks must call it.
bool has_negative_curvature(Equilibrium& equilibrium, ConstFieldView u, const PreconditionerAction& precondition = {}, int most = 500);

}  // namespace perikit
