#pragma once
/// The multigrid cycle of a companion, on however many ranks.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// An approximate inverse of a symmetric, positive definite matrix on its free components, by one cycle of multigrid with
/// smoothed aggregation. All ranks must call both.
class MultigridCycle {
 public:
  virtual ~MultigridCycle() = default;
  /// Asked in the course of `make`, where that may take long: whether the run goes on. Where it does not, what was made is of no use.
  virtual void watch(std::function<bool()>) {}
  /// K: of the problem; on several ranks its rows at owned points are complete. free: 1 on free components of these. rigid: the d
  /// (d + 1)/2 motions of the body as a whole. alike: nothing but some entries of K have changed since the last time, so that
  /// the way to coarser levels may be that of then. Returns whether it is.
  virtual bool make(Problem& problem, const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid, bool alike) = 0;
  /// z <- M^-1 r on free components, 0 elsewhere. r and z may be the same field.
  virtual void apply(ConstFieldView r, FieldView z) = 0;
};

/// On one rank the aggregation of multigrid.hpp. On several ranks that of PETSc, where its library is (petsc/), on the rows that
/// each of them has; else the first rank makes and applies that of one rank, and the others wait. how <- which of the latter two,
/// for the log; empty on one rank.
std::unique_ptr<MultigridCycle> make_multigrid_cycle(const Problem& problem, std::string& how);

}  // namespace perikit
