#pragma once
/// Values of points from all ranks, in the order of the input.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "perikit/problem/body_problem.hpp"

namespace perikit {

/// mine: rows of `width` numbers of the points of this rank, in input order. On rank 0 those of all points, piece by piece:
/// use(first, rows from point `first` on). All ranks must call it.
void gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                   const std::function<void(std::size_t first, std::span<const double> rows)>& use);
/// mine: a number of each point of the set that is this rank's. On rank 0 those of all points of the set, in its order; on the
/// others nothing. All ranks must call it.
std::vector<double> gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine);

}  // namespace perikit
