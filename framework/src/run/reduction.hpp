#pragma once
/// What a history column says of a set of points.

#include "output_fields/point_fields.hpp"
#include "problem/body_problem.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// The values of record.quantity at the points of record.set as one number, as record.reduce says:
///   mean, sum, min, max
///   fit:   a + b.(at - c), an affine function fitted to them by least squares, c the centre of the set; b is 0 in directions in
///   which
///          the set does not extend
///   error: sqrt(sum V (value - exact)^2 / sum V exact^2) at time `t` [s, or the load parameter]. Throws RunError where exact
///   vanishes.
/// Vectors without a component stand for their magnitude. All ranks must call it; rank 0 gets the number.
double reduced(const HistoryDescription& record, BodyProblem& problem, PointFields& fields, double t);

}  // namespace perikit
