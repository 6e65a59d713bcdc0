#pragma once
/// A problem that looks on whenever bonds are about to fail.

#include <functional>

#include "tests/contract/forwarding_problem.hpp"

namespace perikit::contract {

class WitnessProblem final : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;
  std::function<void()> before, after;  ///< of update_bonds

  bool update_bonds(const Configuration& at, double elapsed, FieldView velocity) override {
    if (before) before();
    const bool changed = of_.update_bonds(at, elapsed, velocity);
    if (after) after();
    return changed;
  }
};

}  // namespace perikit::contract
