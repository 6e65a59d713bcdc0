#include "assembled_tangent.hpp"

#include "block_product.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

bool AssembledTangent::assemble_as(Equilibrium& equilibrium, const Configuration& at, bool convex, std::string& failure) {
  solver_.watch([&equilibrium] { return equilibrium.goes_on(); });
  matrix_.convex = convex;
  factorised_ = false;
  const EvaluationStatus status = equilibrium.problem().assemble_tangent(at, matrix_);
  if (!status.ok()) failure = status.description.empty() ? "the tangent met an inadmissible deformation" : status.description;
  return status.ok();
}

bool AssembledTangent::assemble(Equilibrium& equilibrium, const Configuration& at, bool may_convex, std::string& failure) {
  if (equilibrium.parameter() != load_) indefinite_ = false;
  load_ = equilibrium.parameter();
  const bool choose = may_convex && far_from(equilibrium);
  if (choose && indefinite_) return assemble_as(equilibrium, at, true, failure);
  if (!assemble_as(equilibrium, at, false, failure)) return false;
  if (!choose || !matrix_.symmetric) return true;
  factorised_ = solver_.factorise_definite(matrix_, equilibrium.free(), failure);
  if (factorised_ || !failure.empty()) return factorised_;
  indefinite_ = true;
  return assemble_as(equilibrium, at, true, failure);
}

bool AssembledTangent::make(Equilibrium& equilibrium, const Configuration& at, bool may_convex, std::string& failure) {
  if (!assemble(equilibrium, at, may_convex, failure)) return false;
  return factorised_ || (factorised_ = solver_.factorise(matrix_, equilibrium.free(), failure));
}

bool AssembledTangent::indefinite() const noexcept {
  return factorised_ && matrix_.symmetric && !matrix_.convex && solver_.unknowns() > 0 && !solver_.positive_definite() &&
         solver_.reciprocal_condition() >= nearly_singular;
}

void AssembledTangent::multiply(ConstFieldView free, ConstFieldView w, FieldView Kw) const {
  perikit::multiply(matrix_, w, Kw);
  mask(free, Kw);
}

}  // namespace perikit
