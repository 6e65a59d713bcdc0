#pragma once
/// The selective gradient map [Scabbia et al. 24-30, in variational form]: the volume change of an evaluation point is that of
/// its owner, Fh = a Ft with a = (Jbar / Jt)^(1/3), Ft the point's own gradient, Fbar the owner's. With p = P(Fh) : Fh,
///   dpsi/dFt = a P - (p/3) Ft^-T,   dpsi/dFbar = (p/3) Fbar^-T:
/// of an owner, bonds need scalars only, and give it the scalar sum of W p/3. A pair-symmetric Ft is mapped for both of its
/// owners.
///
/// The volume of an owner whose bonds fail counts for less and less: a = 1 + c ((Jbar / Jt)^(1/3) - 1), c the share of its influence at
/// the set-up that is left (and p/3 is (a - 1 + c) P : Ft / 3). c = 0 for an owner without a gradient of its own. Why: decision 0010.

#include <cstddef>
#include <cstdint>

#include "perikit/core/space.hpp"

namespace perikit {

/// Components of an owner's volume change: Jbar - 1, Jbar^(1/3), c, and (tangents) tr(Fbar^-1 dFbar).
inline constexpr int volume_jacobian = 0, volume_root = 1, volume_share = 2, volume_rate = 3, volume_components = 4;

/// Gradients of n points (a multiple of `padding`), in-space components: H[c * stride + point].
struct OwnerGradients {
  int n;
  std::size_t stride;
  const double* H;   ///< Fbar - I
  const double* dH;  ///< direction; null: no tangent
};

/// volume[c * stride + point], but for volume_share, which is the caller's. NaN where Jbar <= 0.
void owner_volume(Space space, const OwnerGradients& in, double* volume, std::size_t stride) noexcept;

/// S += dE/dFbar (or, with directions, its derivative) from pressure = sum of W p/3 and pressure_rate = sum of W dp/3, in-space
/// components S[c * stride + point].
void add_owner_stress(Space space, const OwnerGradients& in, const double* pressure, const double* pressure_rate, double* S,
                      std::size_t stride) noexcept;

/// Volume changes where they are: those of a group of `padding` owners from group[k] on, data[c * stride + group[k] + ...].
struct OwnerVolumes {
  const double* data;
  std::size_t stride;
  const std::int64_t* group;
  bool whole;  ///< volume_share is 1 everywhere and not read
};

/// A batch of bonds seen from one or both ends. Arrays [component][lane] have stride batch_points; what belongs to end e of
/// lane l lies at e * lanes + l.
struct SelectiveBatch {
  int lanes;            ///< a multiple of `padding`; ends * lanes <= batch_points
  int ends;             ///< 1 or 2
  const double* Ht;     ///< Ft - I, in-space
  const double* dHt;    ///< its direction; null: no tangent
  OwnerVolumes volume;  ///< groups of lanes by end
  double* inverse;      ///< 1/Jt by lane, from the map to the pull-back
  double* growth;       ///< a - 1 by end, likewise
};

/// H <- Fh - I and, for a tangent, dH <- dFh, by end. All components of the space are written; H is exactly zero at rest.
void selective_map(Space space, const SelectiveBatch& in, double* H, double* dH) noexcept;

/// What becomes of the stress of the mapped gradients.
struct SelectiveStress {
  double sign;              ///< of the result
  const double* weight[2];  ///< W of each end by lane
  const double* P;          ///< dpsi/dFh by end
  const double* dP;         ///< A : dFh by end; null: no tangent
  double* S;                ///< sum over ends of W dpsi/dFt (tangent: of its derivative), in-space; may be P
  double* pressure;         ///< W p/3 by end
  double* pressure_rate;    ///< W dp/3 by end; tangent only
};
void selective_pull_back(Space space, const SelectiveBatch& in, const SelectiveStress& stress) noexcept;

}  // namespace perikit
