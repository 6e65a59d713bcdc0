#pragma once
/// What a bond sets free as it weakens, with displacements held: dE/db_ij of the stored energy
///
///   E = sum_q W_q(b) psi(H_q(b, u)) + penalties.
///
/// Gradients follow from bonds, too: H = sum_k u_k (x) g_k changes by z_j (x) g_j / b_j per b_j, z_j = u_j - H xi_j the part of the bond
/// that is not affine. What a bond sets free is the share that it holds, dE/dH : (z (x) g / b) of every gradient that it takes part in,
/// and what corrections, volumes of owners and penalty matrices change by. Kinematics with one gradient of order 1 per point, with
/// bonds, and with weighted gradients of bonds.

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "operators/bond_samples.hpp"
#include "operators/point_flux.hpp"
#include "perikit/model/damage.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// What a criterion looks at with these terms.
DamageTraits asked_of_bonds(const TermParts& parts, const Damage& criterion);

/// Bonds of which it is asked what they set free: those that are named, ascending; or all with an end in `ends`.
struct WantedBonds {
  const GroupMarks& ends;
  std::span<const BondId> named;
  bool operator()(std::int32_t p, std::int32_t far) const noexcept {
    return named.empty() ? marked(ends, static_cast<std::size_t>(p)) || marked(ends, static_cast<std::size_t>(far))
                         : std::ranges::binary_search(named, BondId::of(p, far));
  }
};

class BondRelease {
 public:
  /// Why it is not known of these terms; null where it is.
  static const char* unknown(const TermParts& parts);

  /// `parts` must outlive it. images: of a body that has some, which store nothing, so that one direction of a bond does not stand for both.
  BondRelease(const TermParts& parts, bool images);
  ~BondRelease();
  /// How many bonds away from a point evaluation points matter to what its bonds set free.
  int reach() const noexcept { return parts_.formulation.bond && parts_.formulation.far_share > 0 && !mirrored_ ? 2 : 1; }
  /// Of the wanted bonds of points in the groups `near`, at least. samples: derivatives, of the groups `wide` (those of `near` and, at a reach of 2,
  /// everything in their families).
  void find(ConstFieldView u, const GroupMarks& near, const GroupMarks& wide, const WantedBonds& wanted, const BondSamples& samples);
  /// dE/db_ij by what belongs to p and its evaluation points [J], of an intact bond; the rest is that of the far end.
  double of(std::int32_t p, std::int32_t far) const noexcept;

  /// Whether dE/db_ij follows from the flux at both ends and the energy of the bond alone: of one gradient for both directions
  /// of a bond that needs no more than the gradients of its ends.
  bool follows_from_flux() const noexcept;
  /// Then: of these bonds of p, whole, into `released`. samples: energies of the bonds of p. flux: of forces at u.
  void of(std::int32_t p, const FamilyArrays& family, std::span<const std::size_t> bonds, ConstFieldView u, const PointFlux& flux, const BondSamples& samples,
          double* released) const noexcept;

 private:
  /// A point with its bonds.
  struct Owner {
    std::int32_t point = -1;
    std::vector<std::int32_t> far;
    std::vector<double> released;
    std::vector<double> onto;  ///< evaluation points at bonds: dE/dA of each, A their gradient before the correction
    double H[9];               ///< at a reach of 2, [c * dimension + e]
    std::size_t place_of(std::int32_t end) const noexcept;
  };
  struct Memory;
  template <int D>
  void find_bonds(ConstFieldView u, const GroupMarks& near, const WantedBonds& wanted, const BondSamples& samples);
  /// The bonds of a point; their corrections; its gradient, and what of the bonds is not affine.
  template <int D>
  void load(std::int32_t point, Memory& m) const;
  template <int D>
  void correct(Memory& m) const;
  template <int D>
  void find_gradient(std::int32_t point, ConstFieldView u, Memory& m) const;
  template <int D>
  void find_onto(Owner& owner, const BondSamples& samples, Memory& m) const;
  template <int D>
  void release(Owner& owner, const BondSamples& samples, Memory& m) const;
  template <int D>
  void release_bonds(Owner& owner, const BondSamples& samples, Memory& m, double* S) const;
  template <int D>
  void release_corrections(Owner& owner, const BondSamples& samples, Memory& m) const;
  template <int D>
  void release_weighted(Owner& owner, const BondSamples& samples, Memory& m) const;
  /// Of evaluation points at parts of the family.
  template <int D>
  void release_parts(Owner& owner, const BondSamples& samples, Memory& m) const;
  /// Of evaluation points in the cell of the owner.
  template <int D>
  void release_cell(Owner& owner, const BondSamples& samples, Memory& m) const;
  /// What goes with the weight that is left to the owner's points, which hold so much [J].
  void release_weight(Owner& owner, double stored, const Memory& m) const;
  template <int D>
  void release_penalty(Owner& owner, Memory& m) const;
  /// What the evaluation points of the bonds hold; of a selective map what they do to the owner's volume: see below.
  template <int D>
  void release_shares(Owner& owner, const BondSamples& samples, const Memory& m, double* S) const;
  /// Of a selective map: the pressure on the owner's gradient is added to S, and what the share of its volume does to `released`.
  template <int D>
  void release_volume(Owner& owner, double pressure, double by_share, const Memory& m, double* S) const;
  const Owner& owner_of(std::int32_t p) const noexcept { return owners_[static_cast<std::size_t>(place_[static_cast<std::size_t>(p)])]; }

  const TermParts& parts_;
  ConstFieldView shift_;             ///< of point gradients (spaces/cloud_gradient.hpp); without data: none
  std::span<const double> factors_;  ///< of the weights of evaluation points (EvaluationSpace::set_factors); empty: 1
  bool one_state_;  ///< both directions of a bond have the same gradient, law and stress
  bool mirrored_;   ///< and weights as their normalisers say
  bool through_point_gradient_;   ///< of the owner; else evaluation points have gradients of their own alone
  std::vector<Owner> owners_;
  std::size_t count_ = 0;            ///< of them in use
  std::vector<std::int32_t> place_;  ///< by point: its owner, or -1
  std::vector<std::unique_ptr<Memory>> memory_;
};

}  // namespace perikit
