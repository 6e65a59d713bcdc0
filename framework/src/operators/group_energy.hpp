#pragma once

namespace perikit {

/// Of the evaluation points of a group of eight points [J].
struct GroupEnergy {
  double stored = 0;
  double dissipated = 0;   ///< in the step that the evaluation ends, by laws that say so
};

}  // namespace perikit
