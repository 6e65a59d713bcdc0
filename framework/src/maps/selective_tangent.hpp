#pragma once
/// Second derivatives of psi(a Ft), a = 1 + c ((Jbar/Jt)^(1/3) - 1), with respect to Ft and Fbar, in closed form.

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

/// own, mixed, bar <- W d2psi/dFt dFt, W d2psi/dFt dFbar, W d2psi/dFbar dFbar over in-space components, D^2 x D^2 row-major.
template <int D>
void selective_tangent(const SelectiveLane& lane, double* own, double* mixed, double* bar) noexcept;

}  // namespace perikit
