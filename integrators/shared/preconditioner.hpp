#pragma once
/// Preconditioners of the linear systems of load steps, from the assembled tangent.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/plugin/parameters.hpp"
#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

/// An approximate inverse of the tangent on the free components, made at one state and kept over iterations and steps until solves
/// take clearly more iterations than they took with it at first. The state and the counts are kept with the problem: a restored
/// run makes the same preconditioner again.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  /// Before a solve at u. False where it cannot be made; `failure` says why.
  bool prepare(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  /// z <- M^-1 r, 0 on prescribed components; r and z may be the same field.
  virtual void apply(ConstFieldView r, FieldView z) = 0;
  /// To be made anew before the next solve.
  void discard() noexcept { made() = in_hand_ = false; }
  /// Iterations that a solve took.
  void took(int iterations);

 protected:
  explicit Preconditioner(Problem& problem);
  /// Makes it from the tangent.
  virtual bool make(const BlockMatrix& K, ConstFieldView free, std::string& failure) = 0;

 private:
  double& made() noexcept { return numbers_[0]; }
  double& at_first() noexcept { return numbers_[1]; }   ///< iterations of the first solve with it
  double& lately() noexcept { return numbers_[2]; }     ///< and of the last
  FieldView state_;                                     ///< where it was made
  std::span<double> numbers_;
  BlockMatrix tangent_;
  bool in_hand_ = false;
};

/// The key `preconditioner` of an integrator.
void add_preconditioner_key(ParameterTable& table);

/// name: "none" (null), "jacobi" (inverses of the points' diagonal blocks), "factorisation" (the factorised tangent), "auto": the
/// factorisation where the assembled tangent takes at most 2 GB (3D: 0.5 GB, for its factors are fuller), Jacobi up to 4 GB, none beyond.
/// `chosen` <- what auto chose, for the log.
std::unique_ptr<Preconditioner> make_preconditioner(const std::string& name, Problem& problem, std::string& chosen);

}  // namespace perikit
