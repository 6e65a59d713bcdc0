#pragma once
/// The selective gradient map [Scabbia et al. 24-30, in variational form]: the volume change of an evaluation point is that of its
/// owner, Fh = a Ft with a = (Jbar / Jt)^(1/3), Ft the point's own gradient, Fbar the owner's. All lanes of a batch at once.

#include "perikit/core/space.hpp"

namespace perikit {

/// Arrays [component][lane] with stride batch_points. In-space arrays have d*d components, the others those of the space.
struct SelectiveArrays {
  const double* Ht;       ///< Ft - I, in-space
  const double* Hbar;     ///< Fbar - I, in-space
  const double* dHt;      ///< directions; null: no tangent
  const double* dHbar;
  double* scale;          ///< a - 1 by lane, from the map to the pull-back
};

/// H <- Fh - I and, for a tangent, dH <- dFh. All components of the space are written; P(0) stays exactly zero at rest.
void selective_map(Space space, int lanes, const SelectiveArrays& in, double* H, double* dH) noexcept;

/// S_own <- dpsi/dFt, S_bar <- dpsi/dFbar from P = dpsi/dFh; for a tangent, the directional derivatives of both from dP = A:dFh.
/// P and S_own may be the same array (without tangent), dP and S_own likewise (with one).
void selective_pull_back(Space space, int lanes, const SelectiveArrays& in, const double* P, const double* dP, double* S_own, double* S_bar) noexcept;

}  // namespace perikit
