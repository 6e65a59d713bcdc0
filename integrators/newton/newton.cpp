#include "newton.hpp"

#include <fmt/format.h>

#include <utility>

#include "perikit/core/field_operations.hpp"
#include "perikit/core/memory.hpp"

namespace perikit {

bool FactorisedEquations::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  u_ = u;
  const SparseSolver& factors = tangent_.factors();
  if (equilibrium.problem().constant_stiffness() && factors.factorised()) return true;
  const bool first = factors.unknowns() == 0;
  if (!tangent_.make(equilibrium, u, true, failure)) return false;
  if (first) {
    equilibrium.note(fmt::format("  tangent: {} unknowns, {:.3g} numbers, {:.3g} in its factors", factors.unknowns(),
                                 static_cast<double>(tangent_.matrix().values.size()), factors.factor_entries()));
  }
  return true;
}

bool FactorisedEquations::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  if (equilibrium.tangent(u_, w, Kw)) return true;
  failure = equilibrium.failure();
  return false;
}

bool FactorisedEquations::solve(Equilibrium& equilibrium, ConstFieldView rhs, double, FieldView du, std::string& note, std::string&) {
  tangent_.solve(rhs, du);
  // Past a bifurcation or a limit point equilibria are unstable: worth knowing, and no reason to stop.
  if (tangent_.convex())
    note += "  tangent made convex";
  else if (tangent_.matrix().symmetric && !tangent_.factors().positive_definite())
    note += "  tangent not positive definite";
  if (const double condition = tangent_.factors().reciprocal_condition(); condition < 1e-14) {
    note += fmt::format("  tangent nearly singular ({:.1g})", condition);
    if (!std::exchange(warned_, true))
      equilibrium.note("warning: newton: the tangent is nearly singular: some part of the body is hardly held, and where it goes is rounding");
  }
  return true;
}

void Newton::run(Problem& problem, Observer& observer) {
  const AssembledSize size = problem.assembled_size();
  if (const double bytes = static_cast<double>(size.bytes), limit = memory_limit(); bytes > limit) {
    throw RunError(
        fmt::format("newton: the assembled tangent of {} blocks needs {:.3g} GB before it is factorised; "
                    "this machine offers {:.3g} GB; jfnk solves the same problem without it",
                    size.blocks, bytes / 1e9, limit / 1e9));
  }
  FactorisedEquations equations;
  run_newton("newton", values_, problem, observer, equations);
}

}  // namespace perikit
