#pragma once
/// Image points: what lies beyond held faces and surfaces, planes of symmetry and periodic sides, for the families of points near them. The
/// displacement of an image is sign * u(source) and what faces prescribe; it stores nothing of its own, and forces on it go back to
/// its source.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

/// Points in front of a plane across `axis` have images behind it: mirrored, or (period > 0) those within reach of the opposite side
/// shifted by the period.
struct ImagePlane {
  int axis = 0;
  double at = 0;                               ///< coordinate [m]
  double outward = 1;                          ///< images lie above (1) or below (-1)
  double period = 0;                           ///< [m]; 0: a mirror
  std::array<bool, 3> odd{};                   ///< components whose mirrored displacement has the other sign
  std::array<int, 3> motion{-1, -1, -1};       ///< which motion an odd component has at the plane; -1: none, it is 0 there
  /// Of a point and its number: the number of the point at the plane below which it lies, -1: it has no image.
  std::function<std::int64_t(const Point& x, std::int64_t number)> surface;
};

/// Points of clouds in front of a surface, where the level is negative, have images at the same distance from their feet behind it. All
/// components of their displacement turn their sign.
struct ImageSurface {
  std::function<double(const Point&)> level;   ///< zero on the surface
  std::array<int, 3> motion{-1, -1, -1};       ///< which motion each component has there
  /// Of a place of the surface: the number of the point next to it that is nearest; `otherwise` where none is near.
  std::function<std::int64_t(const Point& foot, std::int64_t otherwise)> nearest;
};

/// A share of an image's displacement: factor times the motion at a place of a plane (-1: 0). What the image exerts on the plane counts for the
/// point `surface`.
struct ImageTerm {
  std::int32_t image;                          ///< number among the images
  int component, motion;
  double factor;
  Point at;
  std::int64_t surface;                        ///< input number, in the whole body
};

/// A component of a point that lies on a plane itself: the motion of the plane there (-1: 0) is the point's.
struct HeldPoint {
  std::int32_t point;                          ///< input number
  int component, motion;
};

/// The symmetry operation that takes a point to one of its images. Planes across the axes and periods are x -> sign x + shift by axis. Where a body has
/// surfaces, its mirrors are numbered, and `mirrors` names those that the point was reflected at, the last one first.
struct SymmetryOperation {
  std::array<std::int8_t, 3> sign{1, 1, 1};
  std::array<double, 3> shift{};               ///< [m]
  std::string mirrors = {};
  bool at_surface = false;                     ///< one of them is no plane across an axis
  /// -1 after an odd number of reflections at planes that hold displacements along them and none across: stresses turn their sign there.
  std::int8_t of_stress = 1;
};

/// An image on a point of a lattice, or on another image.
class OverlappingImage : public std::domain_error {
 public:
  explicit OverlappingImage(const Point& x);
  explicit OverlappingImage(const std::string& message) : std::domain_error(message) {}
};

struct Images {
  std::vector<Point> position;
  std::vector<std::int32_t> source;            ///< input numbers
  std::vector<double> volume;                  ///< over that of the source
  std::vector<std::array<std::int8_t, 3>> sign;
  std::vector<SymmetryOperation> operation;
  std::vector<ImageTerm> terms;                ///< ascending by image
  std::vector<HeldPoint> held;                 ///< ascending by point; the last one of a component governs it
  std::vector<Crack> cracks;                   ///< of the body, and their images
  std::optional<Lattice> lattice;              ///< that has places for the points of a lattice and for its images

  std::size_t size() const noexcept { return source.size(); }
};

/// How far what the points of a body need of others lies from them [m]: gradients of the far ends of bonds take their whole families.
double halo(double horizon);

class TurningMirrors;

/// Images of points that lie no farther than the halo from planes, axis after axis, so that edges and corners have images of images.
/// A point of a cloud that lies on a mirror stands for the part of its cell in front of it, and its image for the other one: both are at
/// one place, and no bond joins them.
/// Where there are surfaces, mirrors take their turns until none adds an image, and where several could have one, that behind which it
/// lies deepest has it; periodic sides come last. Each point has its images by itself.
class ImageMaker {
 public:
  /// surfaces: of a cloud.
  ImageMaker(const BodyFrame& frame, std::vector<ImagePlane> planes, std::span<const ImageSurface> surfaces = {});
  /// Of a lattice: without surfaces; reach: the halo.
  ImageMaker(int dimension, double reach, std::vector<ImagePlane> planes);
  ~ImageMaker();
  ImageMaker(ImageMaker&&) noexcept;

  /// Appends the images of a point, with the input number `source`; number: what planes are asked for.
  void add(const Point& x, std::int64_t number, std::int32_t source, Images& images) const;
  /// With the images of cracks.
  std::vector<Crack> cracks(std::vector<Crack> cracks) const;
  const std::vector<ImagePlane>& planes() const noexcept { return planes_; }
  /// How far in front of planes points have images [m].
  double reach() const noexcept { return reach_; }

 private:
  int dimension_;
  double reach_, touching_ = 0;
  std::vector<ImagePlane> planes_;
  std::unique_ptr<TurningMirrors> turning_;                   ///< null: without surfaces
  std::vector<std::vector<std::size_t>> across_;              ///< planes across one axis after the other
};

/// The images of all points of a body, ascending by the numbers of their sources.
Images make_images(const Body& body, std::vector<ImagePlane> planes, std::span<const ImageSurface> surfaces = {});

/// The lattice that has places for the cells of another one and for all images that these may have behind planes.
Lattice with_images(const Lattice& lattice, double horizon, std::vector<ImagePlane> planes);

}  // namespace perikit
