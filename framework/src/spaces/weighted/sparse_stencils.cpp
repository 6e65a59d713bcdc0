#include "spaces/weighted/sparse_stencils.hpp"

#include <algorithm>

namespace perikit {

template <int D>
void SparseStencils<D>::append(const LocalStencil<D>& stencil, std::span<const std::int32_t> far) {
  std::vector<double> g;
  stencil.expand(g);
  const std::size_t bonds = far.size();
  for (std::size_t q = 0; q < static_cast<std::size_t>(stencil.points()); ++q) {
    for (std::size_t k = 0; k < bonds; ++k) {
      Entry entry;
      std::copy_n(g.data() + (q * bonds + k) * D, D, entry.g);
      if (std::all_of(entry.g, entry.g + D, [](double x) { return x == 0; })) continue;
      far_.push_back(far[k]);
      g_.push_back(entry);
    }
    entries_.push_back(far_.size());
    share_.push_back(stencil.share(static_cast<int>(q)));
  }
  begin_.push_back(share_.size());
}

template <int D>
void SparseStencils<D>::gradient(std::size_t i, int first, int n, std::size_t p, const Row* u, double* H, std::size_t stride) const noexcept {
  const Row own = u[p];
  for (int q = 0; q < n; ++q) {
    const std::size_t* entries = entries_.data() + begin_[i] + static_cast<std::size_t>(first + q);
    // Two sums by turns: additions need not wait for each other.
    Row sum[2][D] = {};
    std::size_t k = entries[0];
    for (; k + 2 <= entries[1]; k += 2)
      for (std::size_t s = 0; s < 2; ++s) {
        const Row difference = u[far_[k + s]] - own;
        for (int e = 0; e < D; ++e) sum[s][e] += difference * g_[k + s].g[e];
      }
    if (k < entries[1]) {
      const Row difference = u[far_[k]] - own;
      for (int e = 0; e < D; ++e) sum[0][e] += difference * g_[k].g[e];
    }
    for (int e = 0; e < D; ++e) {
      const Row total = sum[0][e] + sum[1][e];
      for (int c = 0; c < D; ++c) H[static_cast<std::size_t>(c * D + e) * stride + static_cast<std::size_t>(8 * q)] = total[c];
    }
  }
}

template <int D>
void SparseStencils<D>::scatter(std::size_t i, int first, int n, std::size_t p, const double* P, std::size_t stride, Row* out) const noexcept {
  Row total{};
  for (int q = 0; q < n; ++q) {
    const std::size_t* entries = entries_.data() + begin_[i] + static_cast<std::size_t>(first + q);
    Row column[D] = {};
    for (int e = 0; e < D; ++e)
      for (int c = 0; c < D; ++c) column[e][c] = P[static_cast<std::size_t>(c * D + e) * stride + static_cast<std::size_t>(8 * q)];
    for (std::size_t k = entries[0]; k < entries[1]; ++k) {
      Row force = column[0] * g_[k].g[0];
      for (int e = 1; e < D; ++e) force += column[e] * g_[k].g[e];
      total += force;
      out[far_[k]] -= force;
    }
  }
  out[p] += total;
}

template <int D>
std::size_t SparseStencils<D>::bytes() const noexcept {
  return begin_.size() * sizeof(std::size_t) + share_.size() * sizeof(double) + entries_.size() * sizeof(std::size_t) +
         far_.size() * sizeof(std::int32_t) + g_.size() * sizeof(Entry);
}

template class SparseStencils<1>;
template class SparseStencils<2>;
template class SparseStencils<3>;

}  // namespace perikit
