#pragma once
/// Eigenvalues and eigenvectors of symmetric tensors in a fixed number of operations, for scalars and packs alike. Stable in the
/// norm of the tensor for every distance of the eigenvalues, from well apart to equal: the eigenvalue that is well apart from the
/// other two comes from the characteristic cubic, its vector from a cross product, the rest is one Jacobi rotation in the
/// plane normal to it.

#include "perikit/core/tensor.hpp"

namespace perikit {

/// a = sum over k of values[k] v_k (x) v_k, where v_k is column k of `vectors`, a rotation.
template <class T, class S>
struct Spectral {
  T values[3];
  Tensor<T, S> vectors;
};

/// v m v^T for symmetric m.
template <class T, class S>
Tensor<T, S> rotate(const Tensor<T, S>& v, const Tensor<T, S>& m) noexcept {
  const Tensor<T, S> half = v * m;
  return Tensor<T, S>::build_symmetric(
      [&](int i, int j) { return detail::contract<S>(i, j, half, [&](int k, int l) { return v(l, k); }); });
}

/// sum over k of values[k] v_k (x) v_k.
template <class T, class S>
Tensor<T, S> compose(const Tensor<T, S>& v, const T* values) noexcept {
  const Tensor<T, S> half = Tensor<T, S>::build([&](int i, int j) { return v(i, j) * values[j]; });
  return Tensor<T, S>::build_symmetric(
      [&](int i, int j) { return detail::contract<S>(i, j, half, [&](int k, int l) { return v(l, k); }); });
}

namespace detail {

/// The rotation (cosine, sine) that makes ((a, b), (b, d)) diagonal: a - t b and d + t b, t the returned tangent.
template <class T>
T jacobi_rotation(T a, T b, T d, T& cosine, T& sine) noexcept {
  const T difference = d - a, twice = b + b;
  const T root = sqrt(difference * difference + twice * twice);
  const T denominator = abs(difference) + root;
  const T size = twice / select(denominator > T(0.0), denominator, T(1.0));
  const T t = select(difference < T(0.0), -size, size);
  cosine = T(1.0) / sqrt(T(1.0) + t * t);
  sine = t * cosine;
  return t;
}

template <class T>
struct Vector {
  T x, y, z;
};
template <class T>
Vector<T> cross(const Vector<T>& a, const Vector<T>& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T dot(const Vector<T>& a, const Vector<T>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Vector<T> times(const Tensor<T, Solid>& m, const Vector<T>& v) noexcept {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z, m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
template <class T, class M>
Vector<T> choose(M mask, const Vector<T>& a, const Vector<T>& b) noexcept {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

}  // namespace detail

template <class T, class S>
requires(S::dimension == 1)
Spectral<T, S> spectral(const Tensor<T, S>& a) noexcept {
  return {{a[0], a[1], a[2]}, {{T(1.0), T(1.0), T(1.0)}}};
}

template <class T, class S>
requires(S::dimension == 2)
Spectral<T, S> spectral(const Tensor<T, S>& a) noexcept {
  T largest = max(max(abs(a[0]), abs(a[3])), abs(a[1]));
  largest = select(largest > T(0.0), largest, T(1.0));  // squares of tiny strains must not underflow
  T cosine, sine;
  const T t = detail::jacobi_rotation<T>(a[0] / largest, a[1] / largest, a[3] / largest, cosine, sine);
  return {{a[0] - t * a[1], a[3] + t * a[1], a[4]}, {{cosine, sine, -sine, cosine, T(1.0)}}};
}

template <class T>
Spectral<T, Solid> spectral(const Tensor<T, Solid>& a) noexcept {
  using V = detail::Vector<T>;
  T largest = T(0.0);
  for (int k = 0; k < 9; ++k) largest = max(largest, abs(a[k]));
  const T scale = max(largest, T(1e-307)), inverse_scale = T(1.0) / scale;   // finite for numbers without digits, too
  const Tensor<T, Solid> b = inverse_scale * a;
  const T mean = trace(b) * T(1.0 / 3.0);
  const Tensor<T, Solid> d = add_diagonal(b, -mean);
  const T square = inner(d, d) * T(1.0 / 6.0);
  const T radius = sqrt(select(square > T(1e-60), square, T(1.0)));
  const Tensor<T, Solid> unit = (T(1.0) / radius) * d;

  // Eigenvalues of `unit` are 2 cos(theta + 2 k pi/3), cos 3 theta = det/2. c = |cos| of the isolated one solves 4c^3 - 3c =
  // |det|/2, c in [sqrt(3)/2, 1], where Newton's slope is never below 6.
  const T half_det = determinant(unit) * T(0.5), r = min(abs(half_det), T(1.0));
  T c = T(0.8660254) + r * (T(0.1666667) - r * T(0.0326921));
  for (int i = 0; i < (std::same_as<T, long double> ? 4 : 3); ++i)
    c = c - (c * (T(4.0) * c * c - T(3.0)) - r) / (T(12.0) * c * c - T(3.0));
  const Tensor<T, Solid> shifted = add_diagonal(unit, select(half_det < T(0.0), c + c, -(c + c)));

  const V row0{shifted[0], shifted[1], shifted[2]}, row1{shifted[3], shifted[4], shifted[5]},
      row2{shifted[6], shifted[7], shifted[8]};
  V v = cross(row0, row1);
  const V second = cross(row0, row2), third = cross(row1, row2);
  T length = dot(v, v);
  const T second_length = dot(second, second), third_length = dot(third, third);
  v = choose(second_length > length, second, v);
  length = max(length, second_length);
  v = choose(third_length > length, third, v);
  length = max(length, third_length);
  // length >= 12 unless the deviator is nothing but rounding errors, where every rotation will do
  const auto distinct = length > T(1.0);
  v = choose(distinct, v, V{T(1.0), T(0.0), T(0.0)});
  const T inverse_length = T(1.0) / sqrt(select(distinct, length, T(1.0)));
  v = {v.x * inverse_length, v.y * inverse_length, v.z * inverse_length};

  // A basis u, w of the plane normal to v.
  const auto x_larger = abs(v.x) > abs(v.y);
  V u = choose(x_larger, V{-v.z, T(0.0), v.x}, V{T(0.0), v.z, -v.y});
  const T inverse_u = T(1.0) / sqrt(dot(u, u));
  u = {u.x * inverse_u, u.y * inverse_u, u.z * inverse_u};
  const V w = cross(v, u);
  const V du = times(d, u), dw = times(d, w);
  const T uu = dot(u, du), uw = dot(u, dw), ww = dot(w, dw);
  T cosine, sine;
  const T t = detail::jacobi_rotation(uu, uw, ww, cosine, sine);
  const V p{cosine * u.x - sine * w.x, cosine * u.y - sine * w.y, cosine * u.z - sine * w.z};
  const V q{sine * u.x + cosine * w.x, sine * u.y + cosine * w.y, sine * u.z + cosine * w.z};
  const T isolated = dot(v, times(d, v));
  return {{(mean + isolated) * scale, (mean + (uu - t * uw)) * scale, (mean + (ww + t * uw)) * scale},
          {{v.x, p.x, q.x, v.y, p.y, q.y, v.z, p.z, q.z}}};
}

}  // namespace perikit
