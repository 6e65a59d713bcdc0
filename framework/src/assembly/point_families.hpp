#pragma once
/// The families of a body, lattice or cloud, over block rows: live points numbered in ascending order of their field index.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "families/cloud_families.hpp"
#include "families/lattice_families.hpp"

namespace perikit {

class PointFamilies {
 public:
  PointFamilies(const Body& body, const InfluenceFunction& influence, BondWeight weight);

  const Body& body() const noexcept { return body_; }
  std::size_t rows() const noexcept { return point_.size(); }
  std::size_t bonds() const noexcept { return lists().neighbour.size(); }
  /// Field index of each block row, ascending.
  const std::vector<std::int32_t>& points() const noexcept { return point_; }
  std::size_t point(std::size_t row) const noexcept { return static_cast<std::size_t>(point_[row]); }
  double volume(std::size_t row) const noexcept { return body_.volume(point(row)); }
  /// Intact bonds, in block rows; lists().first numbers them.
  const FamilyLists& lists() const noexcept { return cloud_ ? cloud_->lists : lattice_lists_; }
  std::size_t first(std::size_t row) const noexcept { return static_cast<std::size_t>(lists().first[row]); }
  /// Block rows of the family, ascending, without the point itself.
  std::span<const std::int32_t> neighbours(std::size_t row) const noexcept {
    return {lists().neighbour.data() + first(row), first(row + 1) - first(row)};
  }
  /// Rows with the whole family of a lattice: all of them have the same stencils.
  bool whole(std::size_t row) const noexcept { return !whole_.empty() && whole_[row]; }
  double damage(std::size_t row) const noexcept { return damage_[row]; }   ///< D_i
  /// The share of its influence at the set-up that is left.
  double left(std::size_t row) const noexcept { return first_.damage.empty() ? 1.0 : (1 - damage_[row]) / (1 - first_.damage[row]); }
  double normaliser(std::size_t row) const noexcept { return normaliser_[row]; }   ///< N_i of bond weights over the whole family
  /// Every change of bonds since the set-up. Those that fail stay in the lists, with less or no influence.
  void set_bonds(std::span<const BondChange> changes);
  /// b of a bond.
  double integrity(std::size_t bond) const noexcept { return integrity_.empty() ? 1.0 : integrity_[bond]; }
  /// Bonds in the order of neighbours(row), with the inverse shape tensor.
  void load(std::size_t row, FamilyArrays& out) const;
  /// w_ij of each bond of a loaded family, 1/N_i over the whole one; padded.
  void bond_shares(std::size_t row, const FamilyArrays& family, AlignedVector<double>& share) const;
  std::size_t bytes() const noexcept;

 private:
  void read_lattice();
  /// The family as it was at the set-up.
  void load_first(std::size_t row, FamilyArrays& out) const;
  /// Shape tensor and damage of a row whose bonds have changed.
  void changed(std::size_t row);

  const Body& body_;
  BondWeight weight_;
  std::optional<LatticeFamilies> lattice_;
  std::optional<CloudFamilies> cloud_;
  std::vector<std::int32_t> point_;
  AlignedVector<double> normaliser_, damage_;  ///< by row
  // Lattices.
  FamilyLists lattice_lists_;
  std::vector<std::uint16_t> slot_;  ///< by bond
  std::vector<std::uint8_t> whole_;  ///< by row
  AlignedVector<double> inverse_;    ///< K^-1 by row, 6 components; of clouds only once bonds have changed
  // Once bonds have changed.
  AlignedVector<double> integrity_;  ///< by bond
  bool weakened_ = false;            ///< some b is neither 0 nor 1
  struct First {
    AlignedVector<double> damage, inverse;
    std::vector<std::uint8_t> whole;
  } first_;  ///< of the set-up
};

/// Point gradient of order n: Hbar = sum_k u_k (x) g_k over the bonds, u_k relative to the owner; g[k * d + e]. Order 1:
/// g_k = omega V_k K^-1 xi_k, 0 where K is singular. Whether there is a gradient at all.
bool point_gradient(const FamilyArrays& family, double horizon, int order, std::vector<double>& g);

}  // namespace perikit
