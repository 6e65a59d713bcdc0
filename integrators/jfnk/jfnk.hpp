#pragma once
#include "../shared/krylov_equations.hpp"

namespace perikit {

struct JfnkOptions {
  KrylovOptions krylov;
  ParameterValues values;  ///< as the scene has them: load steps, and for errors
};

/// Jacobian-free Newton-Krylov [Partmann et al., eqs. 3.69-3.81].
class Jfnk final : public Integrator {
 public:
  explicit Jfnk(const JfnkOptions& options) : options_(options) {}
  IntegratorTraits traits() const noexcept override {
    return {.dynamic = false, .quasi_static = true, .several_ranks = !needs_one_rank(options_.krylov.preconditioner)};
  }
  /// Nothing to tell; refuses what the run would.
  std::string plan(Problem& problem) override;
  double memory(Problem& problem) override;
  void run(Problem& problem, Observer& observer) override;

 private:
  InputError without_volumes() const;

  JfnkOptions options_;
};

}  // namespace perikit
