#pragma once
/// Preconditioners of the linear systems of load steps.

#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

/// An approximate inverse of the tangent on the free components.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  /// Before the first solve at u. False where it cannot be built; `failure` says why.
  virtual bool prepare(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) = 0;
  /// z <- M^-1 r, 0 on prescribed components.
  virtual void apply(ConstFieldView r, FieldView z) = 0;
  /// Iterations that the last solve took, so that it knows when to renew itself.
  virtual void took(int iterations) = 0;
};

}  // namespace perikit
