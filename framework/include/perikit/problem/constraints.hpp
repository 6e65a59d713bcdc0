#pragma once
/// Prescribed motion: which components of which points do not follow from forces, and where they are.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "perikit/body/images.hpp"
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

/// What a face prescribes of one component.
struct FaceMotion {
  bool velocity = false;                 ///< [m/s]; else displacement [m]
  SpaceTimeFunction value;
  bool of_set = false;                   ///< a set that consists of the points on the face holds them likewise
};

class Constraints {
 public:
  /// Where several prescriptions name a component of a point, the last one governs it. `body` must outlive the constraints. The images
  /// of the body, if it has any, are constrained where mirrors turn the sign: by what faces prescribe there; points on mirrors likewise. Throws std::domain_error where
  /// velocities and displacements meet in one image.
  Constraints(const Body& body, std::vector<Prescription> prescriptions, const Images& images = {}, std::vector<FaceMotion> motions = {});

  bool any() const noexcept { return !dofs_.empty(); }
  /// Prescribed degrees of freedom as c * stride + p, ascending.
  std::span<const std::int64_t> dofs() const noexcept { return dofs_; }
  /// 1 where component c of point p is free, 0 where prescribed or dead: mask[c * stride + p].
  ConstFieldView free() const;
  /// Points all of whose components are prescribed as 0 at all times.
  std::size_t points_held_at_rest() const;

  /// All overwrite the prescribed components of their last argument and nothing else.
  /// Quasi-static runs; t the load parameter.
  void prescribe_displacement(double t, FieldView u) const;
  /// Images at the start of a run: faces are where `initial` has component c at x, in dynamic runs those with a displacement where that puts
  /// them at t = 0.
  void start_images(const std::function<double(int c, const Point& x)>& initial, bool dynamic, FieldView u) const;
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
  /// A component of an image: the sum of these shares of the motions of faces.
  struct Share {
    int motion;
    double factor;
    Point at;
    double fixed;                        ///< the value where it does not depend on t, before it ramps
  };
  struct ImageDof {
    std::int64_t dof;
    bool velocity, depends_on_time;
    std::size_t first, last;             ///< of its shares
  };
  double value(const ImageDof& image, double t) const;
  void add_images(const Images& images);
  /// What planes hold of points on them.
  void add_held(const Images& images);
  /// visit(dof, velocity, depends_on_time, value(t)) for every constrained component.
  template <class Visit>
  void each(Visit&& visit) const;

  const Body* body_;
  std::vector<Governed> governed_;
  std::vector<FaceMotion> motions_;
  std::vector<ImageDof> image_dofs_;
  std::vector<Share> shares_;
  std::vector<std::int64_t> dofs_;
  mutable Field free_;                   ///< made when asked for
  double last_step_ = 0;                 ///< [s]
};

}  // namespace perikit
