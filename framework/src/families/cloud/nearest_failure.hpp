#pragma once
#include "families/cloud/cloud_rows.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// What a loop over forces that knows the stretch of every bond of a cloud leaves behind, so that bonds far from failing are not looked at a
/// second time.
struct NearestFailure {
  double least_onset = 0;                  ///< of the body
  AlignedVector<double> excess;            ///< by point: largest e - least_onset |xi| of its bonds to larger indices [m]
  const AlignedVector<Row>* u = nullptr;   ///< displacement of that evaluation, point-major; null: unknown
};

}  // namespace perikit
