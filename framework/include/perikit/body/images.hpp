#pragma once
/// Image points: what lies beyond held faces and surfaces, planes of symmetry and periodic sides, for the families of points near them. The
/// displacement of an image is sign * u(source) and what faces prescribe; it stores nothing of its own, and forces on it go back to
/// its source.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
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
  std::vector<std::int32_t> surface;           ///< by input number: the point at the plane below which it lies, -1: it has no image
};

/// Points of clouds in front of a surface, where the level is negative, have images at the same distance from their feet behind it. All
/// components of their displacement turn their sign.
struct ImageSurface {
  std::function<double(const Point&)> level;   ///< zero on the surface
  std::array<int, 3> motion{-1, -1, -1};       ///< which motion each component has there
};

/// A share of an image's displacement: factor times the motion at a place of a plane (-1: 0). What the image exerts on the plane counts for the
/// point `surface`.
struct ImageTerm {
  std::int32_t image;                          ///< number among the images
  int component, motion;
  double factor;
  Point at;
  std::int32_t surface;                        ///< input number, in the whole body
};

struct Images {
  std::vector<Point> position;
  std::vector<std::int32_t> source;            ///< input numbers
  std::vector<double> volume;                  ///< over that of the source
  std::vector<std::array<std::int8_t, 3>> sign;
  std::vector<ImageTerm> terms;                ///< ascending by image
  std::vector<Crack> cracks;                   ///< of the body, and their images

  std::size_t size() const noexcept { return source.size(); }
};

/// How far what the points of a body need of others lies from them [m]: gradients of the far ends of bonds take their whole families.
double halo(const Body& body);

/// Images of the points that lie no farther than the halo from planes, axis after axis, so that edges and corners have images of images.
/// Where there are surfaces, mirrors take their turns until none adds an image, and where several could have one, that behind which it lies
/// deepest has it; periodic sides come last.
Images make_images(const Body& body, std::span<const ImagePlane> planes, std::span<const ImageSurface> surfaces = {});

/// Those of the images of the whole body that a part of it has, by the numbers of the part.
Images images_of_part(const Images& images, const Body& part);

}  // namespace perikit
