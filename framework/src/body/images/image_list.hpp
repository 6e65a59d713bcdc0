#pragma once
/// The images of a point as they are made: mirrored places, and what their displacements are made of.

#include "perikit/body/images.hpp"

namespace perikit {

/// What a mirror, or a shift, makes of a place.
struct ImagePlace {
  Point at{};                ///< of the image
  Point foot{};              ///< where the mirror's motion is taken
  double volume = 1;         ///< over that of the place
  std::int64_t surface = 0;  ///< number of the point that what the image exerts counts for
};

/// A point, and its images after it.
class ImageList {
 public:
  /// The images are appended to `images`, as those of the point with the input number `source`.
  ImageList(int dimension, const Point& x, std::int64_t number, std::int32_t source, Images& images);

  std::size_t size() const noexcept { return position_.size(); }
  const Point& position(std::size_t n) const { return position_[n]; }
  /// Of the point, which planes are asked for; its input number.
  const Point& point() const { return position_.front(); }
  std::int64_t number() const noexcept { return number_; }
  /// Takes the point to place n.
  const SymmetryOperation& operation(std::size_t n) const { return operation_[n]; }

  /// The point lies on a mirror, and its odd components are those of the mirror's motion.
  void hold(const std::array<bool, 3>& odd, const std::array<int, 3>& motion);
  /// The image of place n. operation: takes the point to it; odd: components that turn their sign; motion: which motions these have at the mirror, -1: none.
  void add(std::size_t n, const ImagePlace& image, const SymmetryOperation& operation, const std::array<bool, 3>& odd, const std::array<int, 3>& motion);

 private:
  int dimension_;
  std::int64_t number_;
  std::int32_t source_;
  std::size_t before_;              ///< images of other points
  std::vector<Point> position_;     ///< the point, then its images
  std::vector<SymmetryOperation> operation_;  ///< of each of them
  std::vector<std::size_t> first_;  ///< first term of each of them, and the end
  Images& images_;
};

/// How near to a mirror a point lies on it, and is its own image [m].
inline double touching(double spacing) noexcept { return 1e-4 * spacing; }

/// ImagePlane::surface where every point has an image, and lies below itself.
inline std::int64_t itself(const Point&, std::int64_t number) noexcept { return number; }

/// Appends one of the images of a point, the k-th of `made`, as that of the point with the input number `source`.
void append_image(const Images& made, std::size_t k, std::int32_t source, Images& images);

/// Appends what planes hold of a point itself, which has the input number `source`.
void append_held(const Images& made, std::int32_t source, Images& images);

/// Distance of a place in front of the plane whose points it takes: itself, or the opposite side.
double depth(const ImagePlane& plane, const Point& x);
Point image_of(const ImagePlane& plane, Point x);
/// The operation, and after it the reflection at the plane, or the shift by its period.
SymmetryOperation followed_by(SymmetryOperation operation, const ImagePlane& plane);
/// Appends images of what of the cracks lies in front of the plane.
void mirror_cracks(const ImagePlane& plane, std::vector<Crack>& cracks);

class Mirror;

/// Mirrors, planes among them, that meet at any angle.
class TurningMirrors {
 public:
  /// Periodic planes are left out.
  TurningMirrors(const BodyFrame& frame, std::span<const ImagePlane> planes, std::span<const ImageSurface> surfaces);
  ~TurningMirrors();
  void add_images(ImageList& list) const;
  /// Appends images of what of the cracks lies in front of them.
  void add_cracks(std::vector<Crack>& cracks) const;

 private:
  double even_;
  std::size_t surfaces_;   ///< so many of the mirrors, the first ones
  std::vector<std::unique_ptr<const Mirror>> mirrors_;
};

}  // namespace perikit
