#pragma once
/// What a long piece of work is at, and how long each of its steps took.

#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace perikit {

class WorkSteps {
 public:
  using Show = std::function<void(const std::string& step)>;
  /// show: told of each step as it begins, and of the share of it that is done: "families, 40 %".
  explicit WorkSteps(Show show = {}) : show_(std::move(show)) {}

  /// Ends the step before.
  void begin(std::string step);
  /// How much of the present step is done, from 0 to 1; told a few times a second at most. For one thread, between its loops.
  void share_done(double share);
  void end();
  double seconds() const noexcept;
  /// "families 1.20 s, laws 0.31 s": in their order, those that took a twentieth of all or more.
  std::string summary() const;

 private:
  Show show_;
  std::vector<std::pair<std::string, double>> steps_;  ///< [s]
  std::chrono::steady_clock::time_point began_, told_;
  bool open_ = false;
};

}  // namespace perikit
