#pragma once
/// Bonds that let go in the course of several steps: [damage] gradual = true.
///
/// A bond that fails at once changes the shape tensors of its ends by a jump, and at fixed displacement their gradients too. What
/// the jump costs grows with the square of its size times the stiffest modulus: in nearly incompressible bodies it exceeds what
/// the bond held. Spread over n steps in which the body answers, it costs an n-th. No crack runs faster than a Rayleigh wave: a
/// bond lets go in the time |xi|/c_R that one needs along it.

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/families/fracture.hpp"

namespace perikit {

/// A criterion that breaks bonds at once, with the bonds that it has found and that have not let go yet. What they do next
/// follows from their integrity and from the bonds around them alone, so that checkpoints need nothing more.
class GradualFailure final : public Damage {
 public:
  explicit GradualFailure(std::shared_ptr<const Damage> criterion) : criterion_(std::move(criterion)) {}

  DamageTraits traits() const noexcept override { return {.bits = false}; }
  StretchLimits limits(const DamagePoint& point) const override { return criterion_->limits(point); }
  void integrity(const IntegrityBatch& bonds) const noexcept override { criterion_->integrity(bonds); }

  /// crack_speed: c_R by point [m/s].
  void prepare(const Body& body, Field crack_speed) {
    body_ = &body;
    crack_speed_ = std::move(crack_speed);
  }
  /// Of the update that comes [s].
  void set_time_step(double dt) noexcept { time_step_ = dt; }

  /// Bonds that the criterion found begin to let go. Returns what becomes in this step of all that are at it.
  std::vector<BondChange> let_go(std::vector<BondChange> found);
  /// The bonds of fragments begin to go, all by the same factor in each step: the gradients of fragments stay what they are
  /// meanwhile.
  void fade(std::span<const BondChange> bonds);
  /// The bonds of a checkpoint, each once, and those of its fragments.
  void restore(std::span<const BondChange> log, std::span<const BondChange> of_fragments);

 private:
  double speed(const BondChange& c) const noexcept { return 0.5 * (crack_speed_.data()[c.point] + crack_speed_.data()[c.far]); }

  std::shared_ptr<const Damage> criterion_;
  const Body* body_ = nullptr;
  Field crack_speed_;
  double time_step_ = 0;
  std::map<std::int64_t, BondChange> letting_go_, fading_;  ///< by bond
};

/// The criterion of a body that fails gradually; null for others.
inline GradualFailure* gradual_failure(const std::shared_ptr<const Damage>& law) {
  return const_cast<GradualFailure*>(dynamic_cast<const GradualFailure*>(law.get()));
}

}  // namespace perikit
