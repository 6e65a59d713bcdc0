#pragma once
/// Families of a cloud: lists of intact bonds, their influence, and what point gradients and weights need of them.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "families/cloud_bonds.hpp"
#include "spaces/local_stencil.hpp"
#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"
#include "perikit/model/kinematics.hpp"

namespace perikit {

struct CloudFamilies {
  CloudFamilies(const Body& body, const InfluenceFunction& influence, BondWeight weight);

  const Body& body;
  FamilyLists lists;                  ///< intact bonds
  AlignedVector<double> omega;        ///< by bond; with damage b omega
  AlignedVector<double> inverse;      ///< K^-1 by point, rows of 6; 0 where singular
  AlignedVector<double> weight;       ///< W_i = V_i (1 - D_i) of the point shape
  AlignedVector<double> normaliser;   ///< N_i of bond weights over the whole family: sum V_j or sum omega V_j
  Field condition;                    ///< of K
  Field damage;                       ///< D_i
  std::size_t broken = 0, singular = 0;

  std::size_t bonds() const noexcept { return lists.neighbour.size(); }
  std::span<const std::int32_t> neighbours(std::size_t p) const noexcept {
    return {lists.neighbour.data() + lists.first[p], static_cast<std::size_t>(lists.first[p + 1] - lists.first[p])};
  }
  /// The state of the bonds; made on the first call, bodies without damage have none.
  BondState& bond_state();
  /// b of a bond.
  double integrity(std::size_t bond) const noexcept { return bonds_ ? (*bonds_)[bond] : 1.0; }
  bool fails() const noexcept { return bonds_.has_value(); }
  /// Whether bonds of the point have failed or weakened since the set-up.
  bool lost_bonds(std::size_t p) const noexcept;
  /// The share of its influence at the set-up that a point has left.
  double left(std::size_t p) const noexcept { return left_.empty() ? 1.0 : left_[p]; }
  /// Shape tensors, weights and damage of points whose bonds have changed. Returns the bonds left to those of them that are
  /// fragments, bonds between two of them twice.
  std::vector<BondChange> changed(std::span<const std::int32_t> points);
  /// The family of p as arrays over its bonds.
  void load(std::size_t p, FamilyArrays& out) const;
  std::size_t bytes() const noexcept;

 private:
  /// Returns the support of the family.
  template <int D>
  double changed_point(std::size_t p);
  template <int D>
  void measure_whole();
  template <int D>
  void measure(const InfluenceFunction& influence, BondWeight kind);
  /// Takes the bonds that are marked as cut out of the lists.
  void compact();

  std::optional<CloudBonds> bonds_;
  AlignedVector<double> whole_;       ///< with damage: omega by bond at the set-up,
  AlignedVector<double> intact_;      ///< sum omega V_j at the set-up by point,
  AlignedVector<double> left_;        ///< the share of it that is left,
  AlignedVector<double> total_;       ///< the same sum over the whole family,
  AlignedVector<double> whole_shape_; ///< and its K, rows of 6
  std::vector<std::pair<std::int32_t, std::array<double, 6>>> cracked_shape_;   ///< K of the whole family of points with cut bonds, in any order
};

}  // namespace perikit
