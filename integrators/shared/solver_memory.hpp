#pragma once
/// What linear solvers of load steps take, before there is a matrix.

#include <string>

#include "perikit/problem/problem.hpp"

namespace perikit {

struct FactorSize {
  double numbers = 0;     ///< in a Cholesky factor
  double operations = 0;  ///< to compute it
};

/// Of the tangent of `problem` with `blocks` blocks in its rows: that of nested dissection of a box of as many free points and the same proportions,
/// whose parts are parted by layers as thick as rows reach. Within 1.3 of what CHOLMOD finds on lattices, within 1.7 on bars a few points thick.
FactorSize predict_factor(Problem& problem, double blocks);

/// [bytes], beyond those of the problem: libraries, the assembled tangent and its factors.
double direct_solver_bytes(Problem& problem);
/// A Krylov method that keeps `vectors` fields, and its preconditioner by name, "auto" included.
double krylov_solver_bytes(Problem& problem, const std::string& preconditioner, int vectors);

}  // namespace perikit
