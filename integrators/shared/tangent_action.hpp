#pragma once
#include <string>

#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

/// K(u) w at a state, exactly or by central differences of forces.
class TangentAction {
 public:
  TangentAction(Problem& problem, bool differences);
  /// At u from now on.
  void move_to(ConstFieldView u);
  FieldView state() noexcept { return u_; }
  /// Kw <- K w on free components, 0 elsewhere. False where that fails; `failure` says why.
  bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure);

 private:
  bool difference(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure);

  Problem& problem_;
  bool differences_;
  Field u_, moved_, force_;
};

}  // namespace perikit
