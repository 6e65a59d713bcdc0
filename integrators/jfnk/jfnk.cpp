#include "jfnk.hpp"

#include "../shared/bond_jacobian.hpp"
#include "../shared/solver_memory.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

InputError Jfnk::without_volumes() const {
  return options_.values.error("preconditioner", std::string("found \"mixed\", which needs the point volumes of selective kinematics; allowed here: auto, none, companion") +
                                                     (communicator().size() == 1 ? ", jacobi, factorisation" : ""));
}

std::string Jfnk::plan(Problem& problem) {
  bonds_of_jacobian(options_.values, problem);
  if (options_.krylov.preconditioner == "mixed" && !problem.volumetric_part()) throw without_volumes();
  return {};
}

double Jfnk::memory(Problem& problem) {
  return krylov_solver_bytes(problem, options_.krylov.preconditioner, options_.krylov.restart);
}

void Jfnk::run(Problem& problem, Observer& observer) {
  std::string chosen;
  const std::unique_ptr<LinearisedProblem> equations = make_krylov_equations(problem, options_.krylov, chosen);
  if (!equations) throw without_volumes();
  observer.log("jfnk: preconditioner " + chosen);
  run_newton("jfnk", options_.values, problem, observer, *equations);
}

}  // namespace perikit
