#pragma once
/// Images as they are made: mirrored places, and what their displacements are made of.

#include "perikit/body/images.hpp"

namespace perikit {

/// What a mirror, or a shift, makes of a place.
struct ImagePlace {
  Point at{};                ///< of the image
  Point foot{};              ///< where the mirror's motion is taken
  double volume = 1;         ///< over that of the place
  std::int32_t surface = 0;  ///< input number of the point that what the image exerts counts for
};

/// The points of a body, and their images after them.
class ImageList {
 public:
  explicit ImageList(const Body& body);

  std::size_t size() const noexcept { return position_.size(); }
  const Point& position(std::size_t n) const { return position_[n]; }
  /// Input number of the point that place n is, or is an image of.
  std::int32_t source(std::size_t n) const { return n < real_ ? static_cast<std::int32_t>(n) : images_.source[n - real_]; }
  bool real(std::size_t n) const noexcept { return n < real_; }

  /// odd: components that turn their sign; motion: which motions these have at the mirror, -1: none.
  void add(std::size_t n, const ImagePlace& image, const std::array<bool, 3>& odd, const std::array<int, 3>& motion);
  /// Images of what of the cracks lies in front of the plane.
  void mirror_cracks(const ImagePlane& plane);
  Images take();

 private:
  int dimension_;
  std::size_t real_;
  std::vector<Point> position_;     ///< points of the body, then images
  std::vector<std::size_t> first_;  ///< first term of each of them, and the end
  Images images_;
};

/// Distance of a place in front of the plane whose points it takes: itself, or the opposite side.
double depth(const ImagePlane& plane, const Point& x);
Point image_of(const ImagePlane& plane, Point x);

/// Images by mirrors, planes among them, that meet at any angle. Periodic planes are left out.
void mirror_in_turn(const Body& body, std::span<const ImagePlane> planes, std::span<const ImageSurface> surfaces,
                    ImageList& list);

}  // namespace perikit
