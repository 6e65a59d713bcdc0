#pragma once
/// Where a body is, and when: what every evaluation of forces, tangents and samples takes, by value.

#include "perikit/core/field.hpp"
#include <span>

#include "perikit/core/parallel.hpp"
#include "perikit/core/point_motion.hpp"
#include "perikit/model/external.hpp"

namespace perikit {

class Configuration {
 public:
  /// time: [s], in quasi-static runs the load parameter. time_step > 0 [s]: u ends a step of this length, and laws put what they remember at its end
  /// aside; 0: no step ends. velocity: [m/s], of the points that this rank owns; without data where there is none. The fields must
  /// outlive the configuration.
  Configuration(ConstFieldView u, double time, double time_step = 0, ConstFieldView velocity = {}) noexcept
      : u_(u), velocity_(velocity), time_(time), time_step_(time_step), ends_step_(time_step > 0) {}

  /// Displacements [m], all of which are there when it returns.
  ConstFieldView u() const {
    if (arrival_) arrival_->finish();
    if (motion_) motion_->finish();
    return u_;
  }
  ConstFieldView velocity() const noexcept { return velocity_; }
  double time() const noexcept { return time_; }
  double time_step() const noexcept { return time_step_; }
  bool ends_step() const noexcept { return ends_step_; }

  /// What is given to laws from outside; none by default.
  std::span<const ExternalValue> external() const noexcept { return external_; }

  /// The same with these values, which must outlive it.
  Configuration with_external(std::span<const ExternalValue> values) const noexcept {
    Configuration other = *this;
    other.external_ = values;
    return other;
  }
  /// The same, with the displacements of this field in place of its own, all of which are there.
  Configuration seen_as(ConstFieldView u) const noexcept {
    Configuration other = with(nullptr, nullptr);
    other.u_ = u;
    return other;
  }
  /// The same time and step at other displacements, where the step does not end: what laws would remember is not kept.
  Configuration moved_to(ConstFieldView u) const noexcept {
    Configuration other = seen_as(u);
    other.ends_step_ = false;
    return other;
  }

  // Displacements of which some are not there yet: for loops that begin with the points whose displacements are.
  /// The same where displacements of points of other ranks are on their way.
  Configuration arriving(Arrival& arrival) const noexcept { return with(&arrival, motion_); }
  /// The same where `motion` makes the displacements. It also sets the forces of the points that it moves to zero.
  Configuration moving(PointMotion& motion) const noexcept { return with(arrival_, &motion); }
  /// The displacements as they are now; null: all have arrived, all points have moved.
  ConstFieldView unfinished() const noexcept { return u_; }
  Arrival* arrival() const noexcept { return arrival_; }
  PointMotion* motion() const noexcept { return motion_; }

 private:
  Configuration with(Arrival* arrival, PointMotion* motion) const noexcept {
    Configuration other = *this;
    other.arrival_ = arrival;
    other.motion_ = motion;
    return other;
  }

  ConstFieldView u_, velocity_;
  double time_, time_step_;
  bool ends_step_;
  std::span<const ExternalValue> external_;
  Arrival* arrival_ = nullptr;
  PointMotion* motion_ = nullptr;
};

}  // namespace perikit
