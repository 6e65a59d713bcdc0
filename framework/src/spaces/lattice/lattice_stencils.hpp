#pragma once
/// Point gradients of any order on a lattice, and their adjoint, from stored stencils:
///   H_i = sum_s (u_{i+s} - u_i) (x) g_is,   f_i += sum_s S_i g_is,   f_{i+s} -= S_i g_is.
/// Whole families share one stencil; the others have one for each pattern of eight points.

#include "families/lattice/lattice_families.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

template <int D>
class LatticeStencils {
 public:
  /// Reproducing-kernel gradients of this order, lower where a family does not support it.
  LatticeStencils(const LatticeFamilies& families, int order);

  /// The pattern of this chunk has changed.
  void renew(const LatticeChunk& chunk);
  /// H at the points of the chunk.
  void gradient(const LatticeChunk& chunk, ConstFieldView u, FieldView H) const noexcept;
  /// f += G^T S for the stress S at the points of the chunk; writes live points of their families only.
  void adjoint(const LatticeChunk& chunk, ConstFieldView S, FieldView f) const noexcept;
  /// Points of a lower order than asked for, at the set-up.
  std::size_t fallbacks() const noexcept { return fallbacks_; }
  std::size_t bytes() const noexcept { return g_.size() * sizeof(double); }

 private:
  /// Stores the stencils of the chunk's pattern. Returns how many of its points have a lower order.
  std::size_t make(const LatticeChunk& chunk);
  std::size_t place(const LatticeChunk& chunk) const noexcept { return static_cast<std::size_t>(chunk.pattern + 1) * stencil_size_; }

  const LatticeFamilies& f_;
  int order_;
  std::size_t stencil_size_;
  AlignedVector<double> g_;  ///< [whole, patterns ...][slot][e][lane]
  std::size_t fallbacks_ = 0;
};

}  // namespace perikit
