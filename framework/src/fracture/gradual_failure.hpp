#pragma once
/// Bonds that let go in the course of several steps: [damage] gradual = true.
///
/// A bond that fails at once changes the shape tensors of its ends by a jump, and at fixed displacement their gradients too. What
/// the jump costs grows with the square of its size times the stiffest modulus: in nearly incompressible bodies it exceeds what
/// the bond held. Spread over n steps in which the body answers, it costs an n-th. No crack runs faster than a Rayleigh wave: a
/// bond lets go in the time |xi|/c_R that one needs along it.

#include <map>
#include <span>
#include <vector>

#include "families/bonds.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

/// The bonds that a criterion has found and that have not let go yet. What they do next follows from their integrity and from the
/// bonds around them alone, so that checkpoints need nothing more.
class GradualFailure {
 public:
  /// crack_speed: c_R by point [m/s]. Both must outlive this.
  GradualFailure(const Body& body, const Field& crack_speed) : body_(body), crack_speed_(crack_speed) {}

  /// Bonds that the criterion found begin to let go. Returns what becomes in a step of this length [s] of all that are at it.
  std::vector<BondChange> let_go(std::span<const BondChange> found, double time_step);
  /// The bonds of fragments begin to go, all by the same factor in each step, out of the gradients of their neighbours. Their own gradients
  /// stay what they are, but for needles, which have none (needle_support).
  void fade(std::span<const BondId> bonds);
  /// A bond of the last `let_go` has not been lowered but has this integrity still. A whole one has to be found again.
  void hold(BondId bond, double integrity);
  /// The bonds of a checkpoint that are not whole, and those of its fragments.
  void restore(std::span<const BondChange> changes, std::span<const BondId> of_fragments);

 private:
  double speed(BondId bond) const noexcept { return 0.5 * (crack_speed_.data()[bond.point] + crack_speed_.data()[bond.far]); }

  const Body& body_;
  const Field& crack_speed_;
  std::map<BondId, double> letting_go_, fading_;   ///< integrity by bond
};

}  // namespace perikit
