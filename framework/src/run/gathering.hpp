#pragma once
/// Values of points from all ranks, in the order of the input.

#include <span>
#include <string>
#include <vector>

#include "perikit/problem/body_problem.hpp"

namespace perikit {

/// mine: rows of `width` numbers of the points of this rank, in input order. On rank 0 those of all points, on the others
/// nothing. All ranks must call it.
std::vector<double> gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width);
/// The same for one number a point of a set, in the order of the set.
std::vector<double> gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine);

}  // namespace perikit
