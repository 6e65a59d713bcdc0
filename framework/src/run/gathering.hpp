#pragma once
/// Values of the points of all ranks, on rank 0, in the order that they have on one rank.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "problem/body_problem.hpp"

namespace perikit {

/// use(first point in input order, `width` numbers for each point from there on), piece by piece, on rank 0. mine: of this rank's
/// own points. All ranks must call it.
void gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                   const std::function<void(std::size_t first, std::span<const double> rows)>& use);
/// The same where ranks take turns: use(...) on each rank, of the pieces that are its.
void share_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                  const std::function<void(std::size_t first, std::span<const double> rows)>& use);
/// The rows of the points first ... first + points - 1 in input order, on rank 0; nothing on the others. row(p, out): `width`
/// numbers of the rank's own point p, internal index. All ranks must call it.
std::vector<double> gather_rows(const Body& body, std::size_t first, std::size_t points, std::size_t width,
                                const std::function<void(std::size_t p, double* out)>& row);
/// use(`width` numbers for each of some points of a set) in the order of the set, piece by piece, on rank 0. Sets that list their
/// points come as a whole. mine: of this rank's own points. All ranks must call it.
void gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine, std::size_t width,
                const std::function<void(std::span<const double> rows)>& use);

/// The frames of bodies of more points are written by all ranks together; those of others by rank 0. 2^24; for tests,
/// PERIKIT_GATHERED_POINTS in the environment of all ranks says otherwise, and then pieces have no more points than that.
std::size_t most_points_gathered();

}  // namespace perikit
