#include "spaces/weighted/stencil_shift.hpp"

#include <algorithm>

namespace perikit {

template <int D>
void StencilShift<D>::begin(int points, const FamilyArrays& family) {
  points_ = points;
  bonds_ = family.far.size();
  row_ = family.size;
  d_.assign(static_cast<std::size_t>(points) * D * row_, 0.0);
  H_.clear();
  P_.assign(static_cast<std::size_t>(points) * D * D, 0.0);
}

template <int D>
void StencilShift<D>::set(int q, const FamilyArrays& family, const double* omega, const double* g, ConstFieldView lambda, int first) {
  each_shift<D>(family, omega, g, lambda, first, [&](std::size_t k, std::size_t e, double d) { d_[(static_cast<std::size_t>(q) * D + e) * row_ + k] = d; });
}

template <int D>
void StencilShift<D>::set(int q, const double* d) {
  for (std::size_t e = 0; e < D; ++e)
    for (std::size_t k = 0; k < bonds_; ++k) d_[(static_cast<std::size_t>(q) * D + e) * row_ + k] = d[k * D + e];
}

template <int D>
void StencilShift<D>::gradients(int fields, const double* const (*u)[D]) {
  H_.assign(static_cast<std::size_t>(fields * points_) * D * D, 0.0);
  double* to = H_.data();
  for (int f = 0; f < fields; ++f)
    for (int q = 0; q < points_; ++q, to += D * D) {
      double sums[D][D] = {};   // they do not wait for each other
      for (std::size_t k = 0; k < bonds_; ++k)
        for (int c = 0; c < D; ++c)
          for (int e = 0; e < D; ++e) sums[c][e] += u[f][c][k] * row(q, static_cast<std::size_t>(e))[k];
      for (int c = 0; c < D; ++c) std::copy_n(sums[c], D, to + c * D);
    }
}

template <int D>
void StencilShift<D>::add_gradient(int field, int first, int n, double* H, std::size_t stride) const noexcept {
  for (int q = first; q < std::min(first + n, points_); ++q)
    for (std::size_t c = 0; c < D * D; ++c)
      H[c * stride + static_cast<std::size_t>(q - first)] += H_[static_cast<std::size_t>(field * points_ + q) * D * D + c];
}

template <int D>
void StencilShift<D>::add_stress(int first, int n, const double* P, std::size_t stride) noexcept {
  for (int q = first; q < std::min(first + n, points_); ++q)
    for (std::size_t c = 0; c < D * D; ++c)
      P_[static_cast<std::size_t>(q) * D * D + c] += P[c * stride + static_cast<std::size_t>(q - first)];
}

template <int D>
void StencilShift<D>::add_adjoint(double* const (&t)[D]) const noexcept {
  for (int q = 0; q < points_; ++q)
    for (std::size_t c = 0; c < D; ++c)
      for (std::size_t e = 0; e < D; ++e)
        for (std::size_t k = 0; k < bonds_; ++k) t[c][k] += P_[(static_cast<std::size_t>(q) * D + c) * D + e] * row(q, e)[k];
}

template class StencilShift<1>;
template class StencilShift<2>;
template class StencilShift<3>;

}  // namespace perikit
