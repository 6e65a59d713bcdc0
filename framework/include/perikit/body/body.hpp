#pragma once
/// The points of a body: positions, volumes, sets, materials by point, in the internal order that the kernels want.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "perikit/body/lattice.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/space.hpp"

namespace perikit {

using Point = std::array<double, 3>;

/// A pre-crack: breaks every bond that crosses it. Points on its line or plane count as lying on the positive side.
class Crack {
 public:
  /// Two vertices: a segment in the x-y plane; more: a plane polygon.
  explicit Crack(std::vector<Point> vertices);
  bool cuts(const Point& a, const Point& b) const noexcept;
  /// Whether a bond of this length from x could be cut at all.
  bool near(const Point& x, double length) const noexcept;
  const std::vector<Point>& vertices() const noexcept { return vertices_; }

 private:
  std::vector<Point> vertices_;
  Point lower_{}, upper_{}, normal_{};
};

struct Images;

/// What a point is to a rank: nothing; one whose displacement alone it needs; one that it evaluates, as its own points feel it;
/// an image of one of its own, whose force it needs in full; its own.
enum class Role : std::uint8_t { absent, far, near, image, own };

/// A rank's part of a body that no rank has as a whole. By point:
struct LocalPart {
  std::vector<std::int64_t> places;  ///< in the fields of the whole body
  std::vector<Role> roles;
  std::vector<std::int64_t> numbers;  ///< of the input, in the whole body
  std::int64_t points_of_all_ranks = 0;
};

/// Of a lattice, in input order; places are indices of cells.
struct LatticePart : LocalPart {
  std::array<std::int64_t, 3> first{}, last{};  ///< the box of cells that holds the part
};

/// Of a cloud, in the order of the curve, in whole blocks.
struct CloudPart : LocalPart {
  AlignedVector<double> rows;  ///< {x, y, z, V}, and zeros up to the stride
  std::int64_t places_of_all_ranks = 0;  ///< along the curve: of points, and of their images
};

/// What a body is beside its points.
struct BodyFrame {
  Space space = Space::solid;
  double section = 1;          ///< thickness (2D) [m], area (1D) [m^2], 1 in 3D
  double spacing = 0;          ///< of the lattice, or the mean one of a cloud [m]
  double horizon = 0;          ///< delta [m]
  std::vector<Crack> cracks;
};

/// How many points of a cloud of so many loops take together, one after the other along the curve that orders them: few where there are few, so that
/// threads find blocks that do not touch, many where there are many, so that what a block touches stays in a cache for longer.
constexpr std::size_t cloud_block_points(std::size_t points_of_all_ranks) noexcept {
  std::size_t size = 32;
  while (size < 256 && 2000 * size <= padded(points_of_all_ranks)) size *= 2;
  return size;
}

/// Zero points before and after each field, which kernels may read.
inline constexpr std::size_t field_margin = padding;

/// Internal indices run over [0, stride); only `points` of them are alive, the rest is padding of zero volume.
class Body {
 public:
  /// The given cells of a lattice, by their indices in it, in input order; not empty.
  Body(BodyFrame frame, const Lattice& lattice, std::vector<std::int32_t> cells);
  /// A cloud: positions and volumes [m^3] in input order; not empty.
  Body(BodyFrame frame, const std::vector<Point>& positions, const std::vector<double>& volumes);
  /// A rank's part of a body that no rank has as a whole, in the same order, without sets. Far points have a material of their own, others
  /// the material 0.
  Body(BodyFrame frame, const Lattice& whole, LatticePart part, std::uint16_t far_material);
  Body(BodyFrame frame, CloudPart part, std::uint16_t far_material);

  /// A body with images of its points: input numbers after those of `whole`, a material of their own, in no set. Throws std::domain_error
  /// where two points of a lattice would be one.
  Body(const Body& whole, const Images& images, std::uint16_t image_material);

  /// members: internal indices, each once, in the order that the set shall have. name: not "all". order: see order_of().
  void add_set(const std::string& name, std::vector<std::int32_t> members, std::vector<std::int64_t> order = {}) {
    sets_[name] = std::move(members);
    if (!order.empty()) orders_[name] = std::move(order);
  }
  /// By internal index; see material_ids().
  void set_materials(std::vector<std::uint16_t> ids) { material_ids_ = std::move(ids); }
  /// Input number in the whole body of a ghost, which its owner knows.
  void set_number(std::size_t internal_index, std::int64_t number) {
    numbers_[static_cast<std::size_t>(input_[internal_index])] = number;
  }
  /// Of a part of a cloud: the colours that its blocks have in the whole body.
  void set_block_colours(std::vector<std::int32_t> colours) { colours_ = std::move(colours); }

  const BodyFrame& frame() const noexcept { return frame_; }
  int dimension() const noexcept { return perikit::dimension(frame_.space); }
  Space space() const noexcept { return frame_.space; }
  double section() const noexcept { return frame_.section; }
  std::size_t points() const noexcept { return internal_.size(); }  ///< with ghosts and images
  /// Of the body on all ranks, without images.
  std::size_t points_of_all_ranks() const noexcept { return points_of_all_ranks_; }
  std::size_t stride() const noexcept { return stride_; }
  double spacing() const noexcept { return frame_.spacing; }
  double horizon() const noexcept { return frame_.horizon; }
  /// Null for clouds.
  const Lattice* lattice() const noexcept { return lattice_ ? &*lattice_ : nullptr; }
  /// A field with the margins that the kernels need.
  Field make_field(int components) const { return Field(components, stride_, field_margin); }

  /// Internal index of each input point, and back (-1: padding).
  std::span<const std::int32_t> internal() const noexcept { return internal_; }
  std::int32_t input_of(std::size_t internal_index) const noexcept;

  Point position(std::size_t internal_index) const noexcept;
  double volume(std::size_t internal_index) const noexcept { return positions_.empty() ? uniform_volume_ : positions_[4 * internal_index + 3]; }
  /// Clouds: rows of 4, {x, y, z, V}.
  std::span<const double> rows() const noexcept { return positions_; }
  double uniform_volume() const noexcept { return uniform_volume_; }   ///< of lattices [m^3]
  bool alive(std::size_t internal_index) const noexcept { return alive_[internal_index / 8] >> (internal_index % 8) & 1; }
  /// Bit p % 8 of byte p / 8.
  std::span<const std::uint8_t> alive_bits() const noexcept { return alive_; }

  /// Where the points lie in the fields of the whole body.
  Places places() const noexcept { return {places_, stride_of_whole_}; }
  /// Whether this is a part of a body.
  bool part() const noexcept { return !places_.empty(); }
  /// Of the fields of the whole body.
  std::size_t stride_of_all_ranks() const noexcept { return part() ? stride_of_whole_ : stride_; }
  /// Of a cloud: points of a block.
  std::size_t block_points() const noexcept { return cloud_block_points(stride_of_all_ranks()); }
  /// Of a part: the internal index of the point at a place of the whole body; -1 where it is not here.
  std::int32_t at_place(std::int64_t place) const noexcept;
  /// Input number in the whole body.
  std::int64_t number(std::size_t internal_index) const noexcept {
    const std::int32_t input = input_of(internal_index);
    return numbers_.empty() || input < 0 ? input : numbers_[static_cast<std::size_t>(input)];
  }
  std::vector<std::int64_t> numbers(std::span<const std::int32_t> points) const;
  /// The internal index of the point with this input number in the whole body; -1 where it is not here.
  std::int32_t find(std::int64_t number) const noexcept;
  /// Whether no other rank owns the point.
  bool owns(std::size_t internal_index) const noexcept { return own_.empty() || own_[internal_index]; }
  /// Internal indices of the points whose forces are complete here: those of this rank, and the images of them. One rank: all.
  std::span<const std::int32_t> complete() const noexcept { return own_.empty() ? internal_ : complete_; }
  /// Of a part of a cloud; empty: the colours of blocks are not prescribed.
  const std::vector<std::int32_t>& block_colours() const noexcept { return colours_; }

  /// Points that belong to this body alone: all of them, but for ghosts and images.
  const std::vector<std::int32_t>& owned() const noexcept { return owned_.empty() ? internal_ : owned_; }
  /// Whether it is an image of a point: those have the numbers after all points.
  bool image(std::size_t internal_index) const noexcept {
    return number(internal_index) >= static_cast<std::int64_t>(points_of_all_ranks_);
  }
  /// Internal indices in input order. "all": those that the body owns.
  const std::vector<std::int32_t>& set(const std::string& name) const { return name == "all" ? owned() : sets_.at(name); }
  /// Of a part: the input numbers in the whole body of all members of a set, on whatever rank, in its order; empty where they
  /// ascend.
  std::span<const std::int64_t> order_of(const std::string& set) const noexcept {
    const auto known = orders_.find(set);
    return known == orders_.end() ? std::span<const std::int64_t>() : known->second;
  }
  /// But for "all".
  const std::map<std::string, std::vector<std::int32_t>>& sets() const noexcept { return sets_; }
  /// Which of the materials of the body each point has; empty when all are 0.
  std::span<const std::uint16_t> material_ids() const noexcept { return material_ids_; }
  const std::vector<Crack>& cracks() const noexcept { return frame_.cracks; }
  bool cut(const Point& a, const Point& b) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  void number_lattice(const Lattice& lattice, double volume);
  void number_cloud();
  void copy_sets(const Body& whole, const std::vector<std::int32_t>& place, std::uint16_t others);
  void place_on_lattice(const Lattice& lattice, double volume, const std::vector<Point>& positions);
  void place_cloud(const std::vector<Point>& positions, const std::vector<double>& volumes);
  void keep_places(const std::vector<std::int64_t>& places, const std::vector<Role>& roles);
  void keep_far_material(const std::vector<Role>& roles, std::uint16_t far_material);

  BodyFrame frame_;
  std::size_t stride_ = 0;
  std::optional<Lattice> lattice_;
  std::vector<std::int32_t> internal_;
  AlignedVector<double> positions_;     ///< clouds: rows of 4, {x, y, z, V}
  double uniform_volume_ = 0;
  std::vector<std::int32_t> input_;     ///< inverse of internal_
  std::vector<std::uint8_t> alive_;
  std::vector<std::int32_t> owned_;     ///< empty: all
  std::map<std::string, std::vector<std::int32_t>> sets_;
  std::map<std::string, std::vector<std::int64_t>> orders_;
  std::vector<std::uint16_t> material_ids_;
  std::size_t points_of_all_ranks_ = 0;
  // Of a part; else empty.
  std::vector<std::int64_t> places_;   ///< by internal index
  std::vector<std::int64_t> numbers_;  ///< by input number
  std::vector<std::uint8_t> own_;      ///< by internal index
  std::vector<std::int32_t> complete_;
  std::size_t stride_of_whole_ = 0;
  std::optional<Lattice> whole_lattice_;
  std::vector<std::int32_t> colours_;
};

/// Neighbour lists of a cloud in compressed rows: the family of p is neighbour[first[p] ... first[p + 1]), ascending.
struct FamilyLists {
  std::vector<std::int64_t> first;
  std::vector<std::int32_t> neighbour;
};

/// Points at one place. Of several pairs that one is named whose point has the lowest number.
class CoincidentPoints : public std::domain_error {
 public:
  CoincidentPoints(std::int64_t number, const Point& x);
  std::int64_t number() const noexcept { return number_; }

 private:
  std::int64_t number_;
};

/// 0 < |xi| <= horizon (1 + 1e-10), by a cell list in O(n). `rows`: positions, rows of 4. number(p): of a point; empty: p. Throws
/// CoincidentPoints where two points with numbers lie at one place. Images have a number below 0 and may lie on their sources.
FamilyLists find_families(std::span<const double> rows, std::size_t points, int dimension, double horizon,
                          const std::function<std::int64_t(std::size_t p)>& number = {});

/// By point: whether it is one of `from`, or in the family of one. For points of bodies far larger than a family.
std::vector<std::uint8_t> with_families(std::span<const double> rows, std::size_t points, int dimension, double horizon,
                                        std::vector<std::uint8_t> from);

/// Of the blocks first ... last - 1 of a cloud: where their points and their families are, but for bonds that cracks cut, in units of so many points.
std::vector<std::vector<std::int32_t>> block_reach(const Body& body, std::size_t unit, std::size_t first, std::size_t last);

}  // namespace perikit
