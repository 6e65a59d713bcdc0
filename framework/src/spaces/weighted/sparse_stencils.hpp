#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "families/cloud/cloud_rows.hpp"
#include "spaces/weighted/local_stencil.hpp"

namespace perikit {

/// Stored stencils of points that have few evaluation points, each of which sees some of the bonds: the parts of a horizon, point
/// gradients of higher order. A bond that an evaluation point does not see costs nothing. By evaluation point q, the far ends k and
/// g_qk: H_q = sum_k (u_k - u_i) (x) g_qk.
template <int D>
class SparseStencils {
 public:
  /// Appends the stencil of the next point, with the far ends of its bonds.
  void append(const LocalStencil<D>& stencil, std::span<const std::int32_t> far);

  std::size_t size() const noexcept { return begin_.size() - 1; }
  double share(std::size_t i, int q) const noexcept { return share_[begin_[i] + static_cast<std::size_t>(q)]; }
  /// H_q of evaluation points first ... first + n - 1 of the i-th point appended, point p of the body; H[component * stride + 8 (q - first)].
  void gradient(std::size_t i, int first, int n, std::size_t p, const Row* u, double* H, std::size_t stride) const noexcept;
  /// Forces of W P, in the same places: out[k] -= P g_qk, out[p] += P g_qk.
  void scatter(std::size_t i, int first, int n, std::size_t p, const double* P, std::size_t stride, Row* out) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  struct Entry {
    double g[D];
  };
  std::vector<std::size_t> begin_ = {0};   ///< by point: into share_ and entries_
  std::vector<double> share_;              ///< w_q
  std::vector<std::size_t> entries_ = {0}; ///< by evaluation point: into far_ and g_
  std::vector<std::int32_t> far_;
  std::vector<Entry> g_;
};

}  // namespace perikit
