#pragma once
/// Point terms: what acts on every point of a set beside the formulation, per unit of reference volume. The force density f on a point depends on
/// where the point lies, on its displacement, on its velocity and on the time, not on other points. A foundation, a field of gravity, a drag.

#include "perikit/model/material.hpp"

namespace perikit {

struct TermTraits {
  int constants = 0;              ///< doubles per point that `evaluate` reads
  bool conservative = true;       ///< f = -de/du at every time
  bool dissipates = false;        ///< what f takes out of a motion beyond what e holds is lost. Else it is work of what lies outside of the body
  bool velocity = false;          ///< f depends on the velocity, which explicit runs alone have
  bool time = false;              ///< e or f depends on the time, not only through the constants
  bool constant_tangent = false;  ///< df/du does not depend on u
};

/// n points. Vectors are component-major: component c at point p is x[c * stride + p], one component for each dimension of the body. stride is a
/// multiple of `padding`; arrays are 64-byte aligned, but for constants. Points n ... padded(n) - 1 exist: they repeat the last one on entry and
/// may be written. A null output is not wanted.
struct TermBatch {
  int n = 0;
  std::size_t stride = 0;
  double time = 0;                    ///< [s]; in quasi-static runs the load parameter
  const double* x = nullptr;          ///< position in the reference [m]
  const double* u = nullptr;          ///< displacement [m]
  const double* v = nullptr;          ///< velocity [m/s] of the half step that led here; null unless the traits ask for it
  const double* w = nullptr;          ///< direction of df
  const double* constants = nullptr;  ///< read them by `constant`
  std::size_t constant_stride = 0;    ///< 0: the same constants at all points; else each point has its own
  double* energy = nullptr;           ///< e [J/m^3]
  double* force = nullptr;            ///< f [N/m^3]
  double* dforce = nullptr;           ///< df/du . w [N/m^3]

  /// Constant k at point p, and where it is stored.
  double constant(std::size_t k, int p) const noexcept { return *constant_at(k, p); }
  const double* constant_at(std::size_t k, int p) const noexcept {
    return constant_stride == 0 ? constants + k : constants + k * constant_stride + p;
  }
};

class PointTerm {
 public:
  virtual ~PointTerm() = default;
  virtual TermTraits traits() const noexcept = 0;
  /// The constants [traits().constants] from the numbers and expressions of the part's table, at one point and one time. Throws std::domain_error
  /// naming what is wrong.
  virtual void constants([[maybe_unused]] const MaterialInput& input, [[maybe_unused]] double* out) const {}
  /// Overwrites every wanted output for all n points. Depends on nothing but the batch, so that threads may evaluate at once. Returns the first
  /// point that is inadmissible; what is not finite is.
  virtual Status evaluate(int dimension, const TermBatch& batch) const noexcept = 0;
};

}  // namespace perikit
