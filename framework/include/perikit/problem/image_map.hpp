#pragma once
/// The linear map between the displacements that a problem has and those that its terms see. An image's entry of the former holds what
/// faces prescribe of it, a constrained component like any other, and u(image) = sign * u(source) + that entry. Forces go the other way:
/// the source gets sign * force, and the image keeps its own, from which reactions follow.

#include <cstdint>
#include <vector>

#include "perikit/body/images.hpp"
#include "perikit/core/block_matrix.hpp"

namespace perikit {

class ImageMap {
 public:
  /// `body`, or the part of one, has these images, by its own input numbers.
  ImageMap(const Body& body, const Images& images);

  std::size_t size() const noexcept { return image_.size(); }
  /// u of the problem -> u of the terms.
  void extend(FieldView u) const;
  /// Forces of the terms -> forces of the problem.
  void fold(FieldView force) const;
  /// K <- T^t full T, T being `extend`, over the same block rows. The pattern is made where K has none.
  void fold(const BlockMatrix& full, BlockMatrix& K) const;
  /// field(image) <- field(source).
  void copy_from_sources(FieldView field) const;
  /// H(image) <- what a gradient H(source) is beyond planes of symmetry and periodic sides, in the components of the space. Not
  /// beyond faces that are held: what is prescribed there comes in too.
  void mirror_gradients(FieldView H) const;
  /// Appends the images of the points, internal indices.
  void append_images(std::vector<std::int32_t>& points) const;
  /// Reactions of images, by component, go to the points at the planes: what holds the planes in place [N]. All ranks must call it.
  void gather(FieldView reaction) const;

 private:
  struct Share {
    std::int32_t image;                        ///< internal index
    std::int64_t surface;                      ///< input number in the whole body
    std::int32_t component;
    double factor;
  };
  /// What goes to the points at the planes, in the order of their images.
  struct Part {
    std::int64_t image, surface;               ///< numbers in the whole body
    std::int64_t component;
    double value;
  };
  std::vector<Part> parts_of_all(ConstFieldView reaction) const;

  const Body* body_;
  std::vector<std::int32_t> image_, source_;   ///< internal indices
  std::vector<std::array<double, 3>> sign_;
  std::vector<Share> shares_;
  std::vector<std::int32_t> map_;              ///< by internal index: number of the image, -1
};

}  // namespace perikit
