#pragma once
/// Derivatives of the stresses that the law at Fh = a Ft, a = 1 + c ((Jbar/Jt)^(1/3) - 1), has on Ft and Fbar, in closed form.

namespace perikit {

/// One lane of batches; components have stride batch_points.
struct SelectiveLane {
  const double* Ht;    ///< in-space
  const double* Hbar;  ///< in-space
  const double* P;     ///< at Fh = a Ft, all components of the space
  const double* A;     ///< likewise
  double growth;  ///< a - 1
  double share;   ///< c
  double weight;  ///< W: factor of the results
};

/// own, mixed, back, bar <- W times the derivatives of the stress on Ft by Ft and by Fbar, and of that on Fbar by Ft and by Fbar, over in-space components,
/// D^2 x D^2 row-major. Where A is symmetric, `back` is the transpose of `mixed`.
template <int D>
void selective_tangent(const SelectiveLane& lane, double* own, double* mixed, double* back, double* bar) noexcept;

}  // namespace perikit
