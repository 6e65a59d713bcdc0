#pragma once
/// SUNDIALS vectors that are fields of a Problem: no copies, all threads, sums that do not depend on their number. What else of SUNDIALS has
/// an owner.

#include <memory>

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_nvector.h>

#include "perikit/problem/problem.hpp"

namespace perikit {

/// A SUNDIALS context without MPI and without error output of its own: the callers turn flags into sentences.
class SundialsContext {
 public:
  SundialsContext();
  ~SundialsContext();
  SundialsContext(const SundialsContext&) = delete;
  SundialsContext& operator=(const SundialsContext&) = delete;
  operator SUNContext() const noexcept { return context_; }

 private:
  SUNContext context_ = nullptr;
};

struct VectorDeleter {
  void operator()(N_Vector v) const { N_VDestroy(v); }
};
using FieldVector = std::unique_ptr<_generic_N_Vector, VectorDeleter>;

struct LinearSolverDeleter {
  void operator()(SUNLinearSolver solver) const { SUNLinSolFree(solver); }
};
using LinearSolver = std::unique_ptr<_generic_SUNLinearSolver, LinearSolverDeleter>;

/// A vector over somebody else's field; its clones own fields of the same body, so that both suit the kernels.
/// problem and view must outlive the vector and its clones.
FieldVector wrap(const Problem& problem, FieldView view, SUNContext context);

/// The field behind a vector of `wrap` or one of its clones.
FieldView field_of(N_Vector v);

}  // namespace perikit
