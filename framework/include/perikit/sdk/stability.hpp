#pragma once
/// Whether an equilibrium is stable.

#include "perikit/sdk/tangent_predictor.hpp"

namespace perikit {

/// Kw <- K w on free components, 0 elsewhere, K symmetric; false where that fails.
using StiffnessAction = std::function<bool(ConstFieldView w, FieldView Kw)>;

enum class Curvature { positive, negative, unknown };
/// What conjugate gradients on K find: a motion w of the free points with w . K w < 0 by more than rounding, or only positive curvatures to their end. They
/// start from noise, in which every motion has a part, and end where the residual has become smaller than that part, which it does not before they have met
/// the lowest modes. Unknown after `most` iterations, where they meet a curvature of 0, or where K fails. All ranks must call it.
Curvature curvature_of(Problem& problem, ConstFieldView free, const StiffnessAction& K, const PreconditionerAction& precondition = {}, int most = 500);

/// True where they meet a motion of negative curvature on the tangent at u: the energy of body and
/// loads falls along it, and the equilibrium u is unstable. False where K is positive, semidefinite, or
/// nothing was found by then; without a look where K is constant (Problem::constant_stiffness) and loads do not follow. Of following loads, whose K is not
/// symmetric, the symmetric part decides. All ranks must call it.
bool has_negative_curvature(Equilibrium& equilibrium, ConstFieldView u, const PreconditionerAction& precondition = {}, int most = 500);

}  // namespace perikit
