#pragma once
/// The linear map between the displacements that a problem has and those that its terms see. An image's entry of the former holds what
/// faces prescribe of it, a constrained component like any other, and u(image) = sign * u(source) + that entry. Forces go the other way:
/// the source gets sign * force, and the image keeps its own, from which reactions follow.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "perikit/body/images.hpp"
#include "perikit/core/block_matrix.hpp"

namespace perikit {

class ImageMap {
 public:
  /// `body`, or the part of one, has these images, by its own input numbers.
  ImageMap(const Body& body, const Images& images);

  std::size_t size() const noexcept { return image_.size(); }
  /// Images behind faces and surfaces that are held, internal indices.
  std::span<const std::int32_t> held() const noexcept { return held_; }
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
  /// What `gather` leaves out: reactions of images act on the planes, and not at the points that get them. couple += their moment about
  /// where these points are [N m]: about z in 2D, about x, y and z in 3D. reaction: of images in all components; u: as the terms see
  /// it. The couples and the reactions together have the moment that balances what loads the body, about any place. All ranks must call it.
  void add_couples(ConstFieldView reaction, ConstFieldView u, FieldView couple) const;

 private:
  struct Share {
    std::int32_t image;                        ///< internal index
    std::int64_t surface;                      ///< input number in the whole body
    std::int32_t component;
    double factor;
    Point at;                                  ///< on the plane
  };
  /// What goes to the points at the planes, in the order of their images.
  struct Part {
    std::int64_t image, surface;               ///< numbers in the whole body
    std::int64_t component;
    double value;
  };
  std::vector<Part> parts(ConstFieldView reaction) const;
  static std::vector<Part> of_all(std::vector<Part> parts, const Body& body);
  /// add(point, part) for the parts that points of this rank get.
  void hand_out(const std::vector<Part>& parts, const std::function<void(std::int32_t, const Part&)>& add) const;

  const Body* body_;
  std::vector<std::int32_t> image_, source_;   ///< internal indices
  std::vector<std::int32_t> held_;
  std::vector<std::array<double, 3>> sign_;
  std::vector<Share> shares_;
  std::vector<std::int32_t> map_;              ///< by internal index: number of the image, -1
};

}  // namespace perikit
