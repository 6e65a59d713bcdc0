#pragma once
/// Prescribed motion: which components of which points do not follow from forces, and where they are.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "perikit/problem/space_time_function.hpp"

namespace perikit {

class ByteReader;
class ByteWriter;

/// One component of the motion of some points.
struct Prescription {
  bool velocity = false;                 ///< [m/s]; else displacement [m]
  int component = 0;
  SpaceTimeFunction value;
  std::vector<std::int32_t> points;      ///< internal indices
};

class Constraints {
 public:
  /// Where several prescriptions name a component of a point, the last one governs it. `body` must outlive the constraints.
  Constraints(const Body& body, std::vector<Prescription> prescriptions);

  bool any() const noexcept { return !governed_.empty(); }
  /// Prescribed degrees of freedom as c * stride + p, ascending.
  std::span<const std::int64_t> dofs() const noexcept { return dofs_; }
  /// 1 where component c of point p is free, 0 where prescribed or dead: mask[c * stride + p].
  ConstFieldView free() const;
  /// Points all of whose components are prescribed as 0 at all times.
  std::size_t points_held_at_rest() const;

  /// All overwrite the prescribed components of their last argument and nothing else.
  /// Quasi-static runs; t the load parameter.
  void prescribe_displacement(double t, FieldView u) const;
  /// The velocity that takes the displacement u at t_begin to the prescribed one at t_end. Later differences are taken over this step.
  void prescribe_half_step_velocity(double t_begin, double t_end, ConstFieldView u, FieldView v);
  /// Velocity at t: central differences of prescribed displacements.
  void prescribe_velocity(double t, FieldView v) const;
  /// Acceleration at t: differences of what is prescribed.
  void prescribe_acceleration(double t, FieldView a) const;

  void write(ByteWriter& out) const;
  void read(ByteReader& in);

 private:
  /// What is left of a prescription where later ones have overruled it.
  struct Governed : Prescription {
    std::vector<double> fixed;           ///< values where they do not depend on t, before they ramp
  };
  double value(const Governed& governed, std::size_t k, double t) const;

  const Body* body_;
  std::vector<Governed> governed_;
  std::vector<std::int64_t> dofs_;
  mutable Field free_;                   ///< made when asked for
  double last_step_ = 0;                 ///< [s]
};

}  // namespace perikit
