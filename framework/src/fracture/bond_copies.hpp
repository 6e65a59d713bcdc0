#pragma once
/// Bonds of a body with images, and their copies behind planes and surfaces. The bond from p to the image of q is the mirror of the one from q to the image
/// of p, and beyond a periodic side it is the same bond: copies of a bond are one bond, which the body has only once. They hold together what the derivative
/// of the stored energy by their common integrity says, and they fail together.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "families/bonds.hpp"
#include "families/families.hpp"
#include "perikit/body/images.hpp"

namespace perikit {

class BondCopies {
 public:
  /// The body of the families, or the part of one, has these images. The families must outlive this.
  BondCopies(const Families& families, const Images& images);

  struct Copy {
    std::int32_t point, far;  ///< `point` is the copy of the end that was asked for first
    int real_ends;            ///< how many of them are no images: so many of its evaluation points store energy
    BondId bond() const noexcept { return BondId::of(point, far); }
  };
  /// The copies of the bond between two points that are here, itself among them, in a fixed order.
  void find(std::int32_t point, std::int32_t far, std::vector<Copy>& copies) const;
  /// Adds the copies of all bonds that are named, each once, ascending.
  void add_copies(std::vector<BondId>& bonds) const;
  /// The copies of what changes.
  std::vector<BondChange> with_copies(std::span<const BondChange> changes) const;
  /// The one of these copies that stands for all of them: with as many ends as possible that are no images, and the lowest of these.
  static const Copy& first(std::span<const Copy> copies) noexcept;
  /// Whether this rank says what becomes of these copies: it owns the first one.
  bool decides(std::span<const Copy> copies) const noexcept;
  /// Whether the bond stands for all of its copies, and this rank decides about them.
  bool decides(BondId bond) const;
  /// Adds the images of all marked points, and the points that marked images are images of.
  void add_copies(GroupMarks& marks) const;
  bool image(std::int32_t p) const noexcept { return source_[static_cast<std::size_t>(p)] != p; }
  /// stress <- the stress xx yy zz xy xz yz at the source of a point -> what it is at the point, and the same the other way round.
  void turn_stress(std::int32_t p, double* stress) const noexcept;

 private:
  int relation(std::int32_t p, std::int32_t q) const noexcept {
    return relations_[static_cast<std::size_t>(operation_[static_cast<std::size_t>(p)]) * operations_ + static_cast<std::size_t>(operation_[static_cast<std::size_t>(q)])];
  }
  /// The point and all of its images here.
  std::span<const std::int32_t> orbit(std::int32_t source) const noexcept;
  bool joined(std::int32_t p, std::int32_t q) const noexcept;

  const Families& families_;
  std::vector<std::int32_t> source_;     ///< by point: what it is an image of, or itself
  std::vector<std::uint16_t> operation_; ///< by point: the number of the operation that makes it of its source; 0: none
  std::vector<std::int32_t> images_;
  std::vector<std::int32_t> orbits_;     ///< of each source with images: itself and these
  std::vector<std::int32_t> first_;      ///< by point: where its orbit begins, -1: no images
  std::vector<std::array<double, 6>> stress_;  ///< by image: signs of the stress
  std::vector<std::int32_t> number_;     ///< by point: of the image, -1
  std::size_t operations_ = 1;
  std::vector<int> relations_;           ///< by two operations a, b: the number of a^-1 b among all such
};

}  // namespace perikit
