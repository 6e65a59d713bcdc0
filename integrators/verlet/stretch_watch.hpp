#pragma once
#include <cstddef>
#include <span>

#include "perikit/problem/problem.hpp"
#include "perikit/sdk/eigenvalue.hpp"

namespace perikit {

/// Says when a body has been stretched or compressed so far since its largest eigenvalue was estimated that it must be estimated again. Looks are
/// rare where stretches change slowly.
class StretchWatch {
 public:
  static constexpr std::size_t numbers = 10;
  /// The numbers are kept with the state of the run.
  explicit StretchWatch(std::span<double> kept)
      : least_(kept[0]), largest_(kept[1]), eigenvalue_(kept[2]), power_(kept[3]), margin_(kept[4]), seen_least_(kept[5]), seen_largest_(kept[6]), fastest_(kept[7]), last_(kept[8]), next_(kept[9]) {}

  /// The largest eigenvalue, and the one that is tolerated.
  void estimated(StretchRange range, std::int64_t step, EigenvalueBounds eigenvalue, double tolerated);
  /// A bound that is enough for the next estimate: half-way to what is tolerated, where the eigenvalue hardly rose with the stretches before the last one;
  /// else 0, as it is to be found how it rises.
  double enough(double tolerated) const;
  bool due(std::int64_t step) const noexcept { return static_cast<double>(step) >= next_; }
  /// Whether an estimate is needed.
  bool look(StretchRange range, std::int64_t step);

 private:
  /// By how much the logarithm of the largest stretch, or of the least, has gone beyond that of the last estimate.
  double change(StretchRange range) const;

  double &least_, &largest_;   ///< stretches at the last estimate
  double& eigenvalue_;         ///< the Ritz value that it found; 0: none yet
  double& power_;              ///< of the stretch, with which eigenvalues are expected to rise; 0: nothing is known
  double& margin_;             ///< of the change
  double &seen_least_, &seen_largest_;   ///< stretches at the last look
  double& fastest_;            ///< change of their logarithms in a step, of late
  double& last_;               ///< step of that look, or of the estimate
  double& next_;               ///< step of the next look
};

}  // namespace perikit
