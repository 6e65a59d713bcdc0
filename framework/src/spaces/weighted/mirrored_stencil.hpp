#pragma once
/// The stencil that equal families of a lattice share, block-diagonal by its mirror symmetries.
///
/// A mirror s_e (axis e changes sign) that maps the bonds of a family onto themselves and the evaluation points too,
/// g_{s_e q, s_e k} = S_e g_qk with S_e the reflection of vectors, commutes with the sums H_q = sum_k u_k (x) g_qk. Whole
/// families have D mirrors, families at a face D - 1, at an edge D - 2. The mirrors generate a group G of 2^m elements s; its
/// characters chi(s) = +-1 number the signs under each mirror. Over the orbit of each bond, sums with these signs
///
///   uhat_chi(k) = sum_{s in orbit} chi(s) u_{sk}                                  (a Walsh-Hadamard transform of 1, 2, 4 or 8
///   values)
///
/// turn the dense sums into one small product per character and component,
///
///   m_chi(q)(:, e) = sum_{orbits k} Ghat_e(q, k) uhat_chi'(k),   chi' = chi with the sign under s_e changed,
///   Ghat_e(q, k)   = 1/|orbit of k| sum_s chi'(s) g_{q, sk}(e),
///   H_{sq} = sum_chi chi(s) m_chi(q),
///
/// and a character exists in an orbit where no mirror of sign -1 leaves its elements in place. The adjoint is the transpose of
/// each step; the transforms are symmetric. Families without a mirror have one character and orbits of one element.

#include <array>
#include <cstdint>
#include <vector>

#include "spaces/weighted/local_stencil.hpp"

namespace perikit {

/// Elements that mirrors permute, in orbits, and the positions of the coefficients, sorted by character.
struct MirrorBasis {
  struct Orbit {
    std::int32_t size;
    std::int32_t element[8];   ///< by group element: bit b: the b-th mirror that moves them is applied
    std::int32_t position[8];  ///< of the coefficients, by character in the same bits
  };
  /// images[e][x]: mirror image of x; empty where axis e has no mirror. False where two different mirrors have the same effect.
  bool build(int elements, const std::array<std::vector<std::int32_t>, 3>& images);
  std::vector<Orbit> orbits;
  std::array<std::int32_t, 9> first{};  ///< coefficients of character chi: first[chi] ... first[chi + 1]
};

/// Rows of the blocks with the same displacement coefficients, as many as the registers hold.
struct StencilTile {
  std::int32_t rows, column, columns;
  std::size_t g;           ///< g[k * rows + row] from here
  std::int32_t target[8];  ///< where the row's sums go: (position * D + e) * D * 8
};

template <int D>
class MirroredStencil {
 public:
  /// Evaluation points without a share are left out, except the `owners` first ones. by_bond: the other evaluation points are
  /// bonds.
  MirroredStencil(const FamilyArrays& family, const LocalStencil<D>& stencil, int owners, bool by_bond);

  int bonds() const noexcept { return bonds_; }
  int points() const noexcept { return static_cast<int>(shares_.size()); }
  double share(int q) const noexcept { return shares_[static_cast<std::size_t>(q)]; }
  /// Which of the stencil's evaluation points it is.
  int original(int q) const noexcept { return kept_[static_cast<std::size_t>(q)]; }
  const MirrorBasis& bond_basis() const noexcept { return bond_basis_; }
  const MirrorBasis& point_basis() const noexcept { return point_basis_; }
  std::size_t bytes() const noexcept;

  /// Eight points at a time, one a lane: m = Ghat uhat and t += Ghat^T m. uhat, t: [(position * D + c) * 8 + lane],
  /// m: [((position * D + e) * D + c) * 8 + lane].
  void gradient(const double* uhat, double* m) const noexcept;
  void adjoint(const double* m, double* t) const noexcept;

 private:
  void find_mirrors(const FamilyArrays& family, const std::vector<double>& g, int owners, bool by_bond);
  void make_tiles(const std::vector<double>& g);

  int bonds_;
  bool mirror_[3] = {};
  MirrorBasis bond_basis_, point_basis_;
  std::vector<std::int32_t> kept_;   ///< evaluation points of the stencil
  std::vector<double> shares_;
  std::vector<StencilTile> tiles_;
  AlignedVector<double> g_;
};

}  // namespace perikit
