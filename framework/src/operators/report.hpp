#pragma once
/// What was set up, and what was left out of it: for run.log and --explain.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "families/resting_counts.hpp"

namespace perikit {

/// One decision of the set-up: what was left out, why, and what that saves.
struct SkipNote {
  std::string what, why, saves;
};

struct ModelReport {
  std::size_t bytes = 0;                      ///< of families, references and work fields
  std::size_t bonds = 0;                      ///< directed, intact
  std::size_t evaluation_points = 0;
  std::size_t broken_bonds = 0;               ///< cut by pre-cracks
  std::size_t singular_families = 0;          ///< points without a gradient of their own: H = 0
  std::size_t fallbacks = 0;                  ///< evaluation points that use the whole family, or a lower order
  std::size_t dropped_parts = 0;              ///< parts of families without a gradient of their own
  RestingCounts resting;                      ///< blocks that no wave had reached
  std::vector<SkipNote> skips;
  std::vector<std::string> warnings;                       ///< one line each
  std::vector<std::pair<std::string, std::string>> notes;  ///< further lines of run.log: label and text
};

/// Each of these directed bonds is evaluated once for both ends, since `why`.
SkipNote second_evaluation(std::size_t bonds, std::string why = "the gradient is the same for ij and ji");
/// Bytes in words.
std::string megabytes(double bytes);

}  // namespace perikit
