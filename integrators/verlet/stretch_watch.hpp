#pragma once
#include <cstddef>
#include <span>

#include "perikit/problem/problem.hpp"

namespace perikit {

/// Says when a body has been stretched or compressed so far since its largest eigenvalue was estimated that it must be estimated again. Looks are
/// rare where stretches change slowly.
class StretchWatch {
 public:
  static constexpr std::size_t numbers = 6;
  /// The numbers are kept with the state of the run.
  explicit StretchWatch(std::span<double> kept) : least_(kept[0]), largest_(kept[1]), margin_(kept[2]), before_(kept[3]), last_(kept[4]), next_(kept[5]) {}

  /// The largest eigenvalue may rise by the factor `headroom` from here.
  void estimated(StretchRange range, std::int64_t step, double headroom);
  bool due(std::int64_t step) const noexcept { return static_cast<double>(step) >= next_; }
  /// Whether an estimate is needed.
  bool look(StretchRange range, std::int64_t step);

 private:
  double &least_, &largest_;   ///< stretches at the last estimate
  double& margin_;             ///< by which the logarithm of one of them may change
  double& before_;             ///< by how much it had changed at the last look
  double& last_;               ///< step of that look, or of the estimate
  double& next_;               ///< step of the next look
};

}  // namespace perikit
