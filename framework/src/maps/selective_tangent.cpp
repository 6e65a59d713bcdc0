#include "maps/selective_tangent.hpp"

#include <type_traits>

#include "perikit/core/tensor.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

namespace {

/// F^-T of F = I + H; H in-space.
template <class S>
Tensor<double, S> inverse_transpose(const double* H) noexcept {
  constexpr int d = S::dimension;
  const auto h = Tensor<double, S>::map([&](int c) { return c < d * d ? H[c * batch_points] : 0.0; });
  return 1.0 / (jacobian_minus_one(h) + 1.0) * cofactor(add_diagonal(h, 1.0));
}

}  // namespace

// With m = c (Jbar/Jt)^(1/3) = a - 1 + c, B = A : Ft, B' = Ft : A, p = m P : Ft, s = m^2 Ft : B, t = Ft^-T, b = Fbar^-T, C = m/3 (a B + P),
// C' = m/3 (a B' + P) and (t * t)_(ij)(kl) = t_il t_kj, the derivative of -t:
//   on Ft    by Ft     a^2 A - C (x) t - t (x) C' + (s + p)/9 t (x) t + p/3 t * t
//            by Fbar   C (x) b - (s + p)/9 t (x) b
//   on Fbar  by Ft     b (x) C' - (s + p)/9 b (x) t
//            by Fbar   (s + p)/9 b (x) b - p/3 b * b
template <int D>
void selective_tangent(const SelectiveLane& x, double* own, double* mixed, double* back, double* bar) noexcept {
  using S = std::conditional_t<D == 3, Solid, std::conditional_t<D == 2, Plane, Line>>;
  using T = Tensor<double, S>;
  constexpr int n = D * D;
  const double a = x.growth + 1, m = x.growth + x.share;
  const T t = inverse_transpose<S>(x.Ht), b = inverse_transpose<S>(x.Hbar);
  const T P = T::map([&](int c) { return x.P[c * batch_points]; });
  const T F = add_diagonal(T::map([&](int c) { return c < n ? x.Ht[c * batch_points] : 0.0; }), 1.0);
  T B{}, onto{};   // B'
  for (int r = 0; r < S::components; ++r)
    for (int c = 0; c < S::components; ++c) {
      B[r] += x.A[(r * S::components + c) * batch_points] * F[c];
      onto[c] += x.A[(r * S::components + c) * batch_points] * F[r];
    }
  const double p = m * inner(P, F), trace = (m * m * inner(F, B) + p) / 9;
  const T C = m / 3 * (a * B + P), by = m / 3 * (a * onto + P);   // C, C'
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      const int i = r / D, j = r % D, k = c / D, l = c % D, at = r * n + c;
      own[at] = x.weight * (a * a * x.A[(r * S::components + c) * batch_points] - (C[r] * t[c] + t[r] * by[c]) +
                            trace * t[r] * t[c] + p / 3 * t(i, l) * t(k, j));
      mixed[at] = x.weight * (C[r] * b[c] - trace * t[r] * b[c]);
      back[at] = x.weight * (b[r] * by[c] - trace * b[r] * t[c]);
      bar[at] = x.weight * (trace * b[r] * b[c] - p / 3 * b(i, l) * b(k, j));
    }
  }
}

template void selective_tangent<1>(const SelectiveLane&, double*, double*, double*, double*) noexcept;
template void selective_tangent<2>(const SelectiveLane&, double*, double*, double*, double*) noexcept;
template void selective_tangent<3>(const SelectiveLane&, double*, double*, double*, double*) noexcept;

}  // namespace perikit
