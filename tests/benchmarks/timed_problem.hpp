#pragma once
/// A problem that notes where the time of an integrator goes.

#include <ctime>

#include "tests/contract/forwarding_problem.hpp"

namespace perikit::benchmarks {

/// Processor seconds of the calling process and number of calls.
struct Share {
  double seconds = 0;
  std::int64_t calls = 0;
};

/// Everything goes to another problem; what costs time is timed, and ends.
class TimedProblem final : public contract::ForwardingProblem {
  template <class Work>
  static auto timed(Share& share, Work&& work) {
    const std::clock_t start = std::clock();
    auto result = work();
    share.seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    ++share.calls;
    return result;
  }

 public:
  /// After `most` processor seconds every evaluation fails, so that the integrator gives up.
  TimedProblem(Problem& of, double most) : ForwardingProblem(of), until_(std::clock() + static_cast<std::clock_t>(most * CLOCKS_PER_SEC)) {}
  bool late() const noexcept { return std::clock() > until_; }
  Share forces, actions, assemblies, companions;

  EvaluationStatus evaluate_forces(const Configuration& at, FieldView force, double* energy) override {
    if (late()) return {.point = 0, .description = "time is up"};
    return timed(forces, [&] { return of_.evaluate_forces(at, force, energy); });
  }
  EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) override {
    if (late()) return {.point = 0, .description = "time is up"};
    return timed(actions, [&] { return of_.tangent_action(at, w, Kw); });
  }
  EvaluationStatus assemble_tangent(const Configuration& at, BlockMatrix& K) override {
    return timed(assemblies, [&] { return of_.assemble_tangent(at, K); });
  }
  void assemble_companion(ConstFieldView u, BlockMatrix& K, double most_bulk) override {
    timed(companions, [&] { return of_.assemble_companion(u, K, most_bulk), 0; });
  }

 private:
  std::clock_t until_;
};

}  // namespace perikit::benchmarks
