#pragma once
/// The points of a scene: positions, volumes, sets, materials by point, in the internal order that the kernels want.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "perikit/body/lattice.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/space.hpp"
#include "perikit/scene/scene.hpp"

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

 private:
  std::vector<Point> vertices_;
  Point lower_{}, upper_{}, normal_{};
};

/// Internal indices run over [0, stride); only `points` of them are alive, the rest is padding of zero volume.
class Body {
 public:
  /// Throws InputError for an empty body, an empty set, a horizon smaller than the spacing of all points, too many points.
  /// lists: a lattice is treated as a cloud, since every bond has a number of its own.
  explicit Body(const Scene& scene, bool lists = false);
  /// The kept points of another body, by input number; those that are not owned are ghosts, with a material of their own. Sets keep
  /// owned points.
  Body(const Body& whole, const std::vector<bool>& owned, const std::vector<bool>& kept, std::uint16_t ghost_material);

  int dimension() const noexcept { return dimension_; }
  Space space() const noexcept { return space_; }
  double section() const noexcept { return section_; }
  std::size_t points() const noexcept { return internal_.size(); }   ///< with ghosts
  std::size_t stride() const noexcept { return stride_; }
  double spacing() const noexcept { return spacing_; }   ///< of the lattice, or the mean one of a cloud [m]
  double horizon() const noexcept { return horizon_; }   ///< delta [m]
  /// Null for clouds.
  const Lattice* lattice() const noexcept { return lattice_ ? &*lattice_ : nullptr; }
  /// A field with the margins that the kernels need.
  Field make_field(int components) const { return Field(components, stride_, margin_); }

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

  /// Points that belong to this body alone: all of them, but for ghosts.
  const std::vector<std::int32_t>& owned() const noexcept { return sets_.at("all"); }
  /// Internal indices in input order. "all" exists.
  const std::vector<std::int32_t>& set(const std::string& name) const { return sets_.at(name); }
  const std::map<std::string, std::vector<std::int32_t>>& sets() const noexcept { return sets_; }
  /// Index into the materials of the scene (0: [material], 1 ...: [[region]] in order); empty when all are 0.
  std::span<const std::uint16_t> material_ids() const noexcept { return material_ids_; }
  const std::vector<Crack>& cracks() const noexcept { return cracks_; }
  bool cut(const Point& a, const Point& b) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  void place_lattice(const Scene& scene, bool lists);
  void number_lattice(const Lattice& lattice, double volume);
  void place_cloud(std::vector<Point> positions, std::vector<double> volumes);
  void collect_sets(const Scene& scene);

  int dimension_;
  Space space_;
  double section_;
  double spacing_ = 0, horizon_ = 0;
  std::size_t stride_ = 0, margin_ = 0;
  std::optional<Lattice> lattice_;
  std::vector<std::int32_t> internal_;
  AlignedVector<double> positions_;     ///< clouds: rows of 4, {x, y, z, V}
  double uniform_volume_ = 0;
  std::vector<std::int32_t> input_;     ///< inverse of internal_
  std::vector<std::uint8_t> alive_;
  std::map<std::string, std::vector<std::int32_t>> sets_;
  std::vector<std::uint16_t> material_ids_;
  std::vector<Crack> cracks_;
};

/// Neighbour lists of a cloud in compressed rows: the family of p is neighbour[first[p] ... first[p + 1]), ascending.
struct FamilyLists {
  std::vector<std::int64_t> first;
  std::vector<std::int32_t> neighbour;
};

/// |xi| <= horizon (1 + 1e-10), by a cell list in O(n). `rows`: positions, rows of 4. Throws std::domain_error for coincident points.
FamilyLists find_families(std::span<const double> rows, std::size_t points, int dimension, double horizon);

/// Order of points along a space-filling (Morton) curve of boxes of size `cell`.
std::vector<std::int32_t> morton_order(const std::vector<Point>& positions, double cell);

}  // namespace perikit
