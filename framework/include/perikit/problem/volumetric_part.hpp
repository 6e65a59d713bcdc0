#pragma once
/// The part of the stiffness that resists changes of volume, where volumes are those of point gradients (selective kinematics).

#include "perikit/core/evaluation_status.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// At one state the tangent is K = A + B^T W B, B the rates of the logarithmic volumes of points and W a diagonal of about their
/// bulk moduli times volumes, A what is left: with W near the whole, A is the tangent of a compressible body. B has one row a
/// point,
///
///   (B w)_i = tr(Fbar_i^-1 dFbar_i) = d(ln Jbar_i) w,   Fbar the point gradient:
///
/// where a body has far more bulk than shear modulus, pressures p = W B u as further unknowns make its equations well
/// conditioned. Fields of displacements and forces have `dimension` components, those of volumes and pressures one. On several
/// ranks fields are zero at ghosts, as all of a problem are, and all ranks must call what takes one.
class VolumetricPart {
 public:
  virtual ~VolumetricPart() = default;
  /// B at u, with the bonds as they are, from now on. Not ok where u is inadmissible, on whatever rank.
  virtual EvaluationStatus linearise(ConstFieldView u) = 0;
  /// q <- B w [-], 0 at dead points.
  virtual void rates(ConstFieldView w, FieldView q) const = 0;
  /// f <- B^T q [J/m]; the adjoint of `rates` to rounding.
  virtual void forces(ConstFieldView q, FieldView f) const = 0;
  /// q <- the diagonal of B C B^T, C = diag(c).
  virtual void squares(ConstFieldView c, FieldView q) const = 0;
  /// ln Jbar by point, of the state of B. This and `stiffness` are of the points that a rank owns, and nobody's at ghosts.
  virtual ConstFieldView logarithms() const = 0;
  /// By point: the second derivative of its energy where its volume grows alone, d^2/d(ln Jbar)^2 [J]; 0 where there is no
  /// energy.
  virtual ConstFieldView stiffness() const = 0;
};

}  // namespace perikit
