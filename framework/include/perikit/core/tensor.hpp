#pragma once
/// Second-order tensors of a space: all nine components, or only those that can differ from zero in plane and line problems.
/// A plane tensor never computes an xz component.

#include <cstddef>
#include <utility>

#include "perikit/core/dual.hpp"
#include "perikit/core/space.hpp"

/// Loops over components are unrolled whole, so that absent components cost nothing.
#define PERIKIT_UNROLL _Pragma("GCC unroll 9")

namespace perikit {

struct Solid {
  static constexpr int components = 9, dimension = 3;
  static constexpr bool confined = false;
};  ///< xx xy xz yx yy yz zx zy zz
struct Plane {
  static constexpr int components = 5, dimension = 2;
  static constexpr bool confined = false;
};  ///< xx xy yx yy zz
struct Line {
  static constexpr int components = 3, dimension = 1;
  static constexpr bool confined = false;
};  ///< xx yy zz

/// Plane and uniaxial strain: the lateral components of displacement gradients and strains are zero, known when compiling. Their
/// stresses have lateral components as any other.
struct ConfinedPlane : Plane {
  static constexpr bool confined = true;
};
struct ConfinedLine : Line {
  static constexpr bool confined = true;
};

/// Component ii of displacement gradients and strains is always zero.
template <class S>
constexpr bool always_zero(int i) noexcept {
  return S::confined && i >= S::dimension;
}

/// Place of component ij, -1 where it is always zero.
template <class S>
constexpr int component(int i, int j) noexcept {
  if constexpr (S::dimension == 3)
    return 3 * i + j;
  else if constexpr (S::dimension == 2)
    return i == 2 || j == 2 ? (i == j ? 4 : -1) : 2 * i + j;
  else
    return i == j ? i : -1;
}

template <class S>
constexpr int row(int k) noexcept {
  return S::dimension == 3 ? k / 3 : S::dimension == 2 ? k / 2 : k;
}
template <class S>
constexpr int column(int k) noexcept {
  return S::dimension == 3 ? k % 3 : S::dimension == 2 ? (k == 4 ? 2 : k % 2) : k;
}

template <class T, class S>
struct Tensor {
  using Scalar = T;
  using TensorSpace = S;
  static constexpr int size = S::components;
  T c[size];

  T& operator[](int k) noexcept { return c[k]; }
  const T& operator[](int k) const noexcept { return c[k]; }
  T& operator()(int i, int j) noexcept { return c[component<S>(i, j)]; }
  const T& operator()(int i, int j) const noexcept { return c[component<S>(i, j)]; }

  friend Tensor operator+(const Tensor& a, const Tensor& b) noexcept {
    return map([&](int k) { return a[k] + b[k]; });
  }
  friend Tensor operator-(const Tensor& a, const Tensor& b) noexcept {
    return map([&](int k) { return a[k] - b[k]; });
  }
  template <std::convertible_to<T> U>
  friend Tensor operator*(const U& s, const Tensor& a) noexcept {
    return map([&](int k) { return s * a[k]; });
  }
  template <std::convertible_to<T> U>
  friend Tensor operator*(const Tensor& a, const U& s) noexcept {
    return s * a;
  }
  template <std::convertible_to<T> U>
  friend Tensor operator/(const Tensor& a, const U& s) noexcept {
    return map([&](int k) { return a[k] / s; });
  }
  friend Tensor operator-(const Tensor& a) noexcept {
    return map([&](int k) { return -a[k]; });
  }

  /// Components f(k). (Not a loop over a default-constructed tensor: that one would be cleared in memory first.)
  template <class F>
  static Tensor map(F&& f) noexcept {
    return [&]<std::size_t... k>(std::index_sequence<k...>) {
      return Tensor{{static_cast<T>(f(int(k)))...}};
    }
    (std::make_index_sequence<size>{});
  }
  /// Components f(i, j).
  template <class F>
  static Tensor build(F&& f) noexcept {
    return map([&](int k) { return f(row<S>(k), column<S>(k)); });
  }
  /// As build, asking only for i <= j.
  template <class F>
  static Tensor build_symmetric(F&& f) noexcept {
    return build([&](int i, int j) { return f(i < j ? i : j, i < j ? j : i); });
  }
  /// The unit tensor of component k.
  static Tensor unit(int k) noexcept {
    return map([&](int l) { return T(l == k ? 1.0 : 0.0); });
  }
};

template <class T, class S>
Tensor<T, S> transpose(const Tensor<T, S>& a) noexcept {
  return Tensor<T, S>::build([&](int i, int j) { return a(j, i); });
}

template <class T, class S>
T trace(const Tensor<T, S>& a) noexcept {
  return a(0, 0) + a(1, 1) + a(2, 2);
}

/// a + s I.
template <class T, class S, class U>
Tensor<T, S> add_diagonal(const Tensor<T, S>& a, const U& s) noexcept {
  return Tensor<T, S>::map([&](int k) { return row<S>(k) == column<S>(k) ? T(a[k] + s) : a[k]; });
}

/// a - tr(a)/3 I.
template <class T, class S>
Tensor<T, S> deviator(const Tensor<T, S>& a) noexcept {
  return add_diagonal(a, trace(a) * (-1.0 / 3.0));
}

namespace detail {
/// r + a b. Products of numbers with a derivative (core/dual.hpp) are fused with the sum, too, as those of packs are by themselves.
template <class T, class A, class B>
auto plus_product(const T& r, const A& a, const B& b) noexcept {
  if constexpr (requires { a.derivative; b.derivative; })
    return T(r.value + a.value * b.value, (r.derivative + a.value * b.derivative) + a.derivative * b.value);
  else
    return r + a * b;
}
/// sum over k of a(i, k) b(k, j), over products that can differ from zero; A and B give the components.
template <class S, class A, class B>
auto contract(int i, int j, A&& a, B&& b) noexcept {
  decltype(a(i, i) * b(i, j) + a(i, i) * b(i, j)) r = a(i, i) * b(i, j);
  PERIKIT_UNROLL for (int k = 0; k < 3; ++k) if (k != i && component<S>(i, k) >= 0 && component<S>(k, j) >= 0) r =
      plus_product(r, a(i, k), b(k, j));
  return r;
}
}  // namespace detail

template <class T, class S>
Tensor<T, S> operator*(const Tensor<T, S>& a, const Tensor<T, S>& b) noexcept {
  return Tensor<T, S>::build([&](int i, int j) { return detail::contract<S>(i, j, a, b); });
}

/// a^T b.
template <class T, class S>
Tensor<T, S> transpose_times(const Tensor<T, S>& a, const Tensor<T, S>& b) noexcept {
  return Tensor<T, S>::build([&](int i, int j) {
    return detail::contract<S>(
        i, j, [&](int k, int l) { return a(l, k); }, b);
  });
}

/// of(c) over the components of a tensor, in three sums, which do not wait for each other.
template <class S, class Of>
auto sum_of_components(const Of& of) noexcept {
  decltype(of(0) + of(0)) sum[3] = {of(0), of(1), of(2)};
  PERIKIT_UNROLL for (int c = 3; c < S::components; ++c) sum[c % 3] = sum[c % 3] + of(c);
  return sum[0] + sum[1] + sum[2];
}

/// a : b, the sum of all products of components.
template <class T, class S>
T inner(const Tensor<T, S>& a, const Tensor<T, S>& b) noexcept {
  T sum[3] = {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
  PERIKIT_UNROLL for (int c = 3; c < S::components; ++c) sum[c % 3] = detail::plus_product(sum[c % 3], a[c], b[c]);
  return sum[0] + sum[1] + sum[2];
}

/// (a + a^T)/2.
template <class T, class S>
Tensor<T, S> symmetric_part(const Tensor<T, S>& a) noexcept {
  return Tensor<T, S>::build_symmetric([&](int i, int j) { return i == j ? a(i, i) : (a(i, j) + a(j, i)) * 0.5; });
}

/// a^T a, exactly symmetric.
template <class T, class S>
Tensor<T, S> gram(const Tensor<T, S>& a) noexcept {
  return Tensor<T, S>::build_symmetric([&](int i, int j) {
    return detail::contract<S>(
        i, j, [&](int k, int l) { return a(l, k); }, a);
  });
}

/// F^T F - I of F = I + H, without forming F: small strains keep their digits. Exactly symmetric.
template <class T, class S>
Tensor<T, S> right_cauchy_green_minus_identity(const Tensor<T, S>& H) noexcept {
  const Tensor<T, S> square = gram(H);
  return Tensor<T, S>::build_symmetric(
      [&](int i, int j) { return always_zero<S>(i) ? T(0.0) : T((H(i, j) + H(j, i)) + square(i, j)); });
}

/// F F^T - I of F = I + H.
template <class T, class S>
Tensor<T, S> left_cauchy_green_minus_identity(const Tensor<T, S>& H) noexcept {
  return right_cauchy_green_minus_identity(transpose(H));
}

/// Sum of the principal minors of order two.
template <class T, class S>
T second_invariant(const Tensor<T, S>& a) noexcept {
  T r = a(0, 0) * a(1, 1) + a(2, 2) * (a(0, 0) + a(1, 1));
  if constexpr (S::dimension >= 2) r = r - a(0, 1) * a(1, 0);
  if constexpr (S::dimension == 3) r = r - a(0, 2) * a(2, 0) - a(1, 2) * a(2, 1);
  return r;
}

/// det(a) a^-T.
template <class T, class S>
Tensor<T, S> cofactor(const Tensor<T, S>& a) noexcept {
  if constexpr (S::dimension == 3) {
    return Tensor<T, S>::build([&](int i, int j) {
      const int k = (i + 1) % 3, l = (i + 2) % 3, m = (j + 1) % 3, n = (j + 2) % 3;
      return a(k, m) * a(l, n) - a(k, n) * a(l, m);
    });
  } else if constexpr (S::dimension == 2) {
    return {{a(1, 1) * a(2, 2), -(a(1, 0) * a(2, 2)), -(a(0, 1) * a(2, 2)), a(0, 0) * a(2, 2),
             a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0)}};
  } else {
    return {{a[1] * a[2], a[2] * a[0], a[0] * a[1]}};
  }
}

template <class T, class S>
T determinant(const Tensor<T, S>& a) noexcept {
  if constexpr (S::dimension == 3) {
    return a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) + a(0, 1) * (a(1, 2) * a(2, 0) - a(1, 0) * a(2, 2)) +
           a(0, 2) * (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0));
  } else if constexpr (S::dimension == 2) {
    return (a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0)) * a(2, 2);
  } else {
    return a(0, 0) * a(1, 1) * a(2, 2);
  }
}

/// det(I + H) - 1 - tr(H), from the invariants of H.
template <class T, class S>
T jacobian_beyond_trace(const Tensor<T, S>& H) noexcept {
  if constexpr (S::confined && S::dimension == 2)
    return H(0, 0) * H(1, 1) - H(0, 1) * H(1, 0);
  else if constexpr (S::confined)
    return T(0.0);
  else
    return second_invariant(H) + determinant(H);
}

/// det(I + H) - 1.
template <class T, class S>
T jacobian_minus_one(const Tensor<T, S>& H) noexcept {
  if constexpr (S::confined && S::dimension == 1)
    return H(0, 0);
  else if constexpr (S::confined)
    return (H(0, 0) + H(1, 1)) + jacobian_beyond_trace(H);
  else
    return trace(H) + jacobian_beyond_trace(H);
}

/// cof(I + H) - I = tr(H) I - H^T + cof(H).
template <class T, class S>
Tensor<T, S> cofactor_minus_identity(const Tensor<T, S>& H) noexcept {
  if constexpr (S::confined && S::dimension == 2)
    return {{H(1, 1), -H(1, 0), -H(0, 1), H(0, 0), jacobian_minus_one(H)}};
  else if constexpr (S::confined)
    return {{T(0.0), H(0, 0), H(0, 0)}};
  const Tensor<T, S> quadratic = cofactor(H);
  return Tensor<T, S>::build([&](int i, int j) {
    if (i != j) return quadratic(i, j) - H(j, i);
    return quadratic(i, i) + (H((i + 1) % 3, (i + 1) % 3) + H((i + 2) % 3, (i + 2) % 3));
  });
}

/// Second invariant of e = F F^T - I, with j = det F - 1. In plane strain it is the determinant of the block in the plane, and
/// det(I + e) = (1 + j)^2 = 1 + tr(e) + I2(e).
template <class T, class S>
T second_invariant_of_strain(const Tensor<T, S>& e, const T& j) noexcept {
  if constexpr (S::confined)
    return S::dimension == 2 ? T(j * (2.0 + j) - trace(e)) : T(0.0);
  else
    return second_invariant(e);
}

/// a (F - F^-T) + p F^-T of F = I + H, from G = cof F - I and j = det F - 1: every term of the order of H, a and p.
template <class T, class S>
Tensor<T, S> two_term_stress(const T& a, const T& p, const Tensor<T, S>& H, const Tensor<T, S>& G, const T& j, const T& inverse_J) noexcept {
  const T on_cofactor = (p - a) * inverse_J, on_identity = (a * j + p) * inverse_J;
  return Tensor<T, S>::build([&](int i, int k) {
    const T off = a * H(i, k) + on_cofactor * G(i, k);
    return i == k ? T(off + on_identity) : off;
  });
}

/// (a e - s cof(e) + p I) F^-T of F = I + H, e = F F^T - I, with second = I2(e). In plane strain cof(e) = I2(e) in the direction
/// across and zero in the plane, and e F^-T = F - F^-T saves the product.
template <class T, class S>
Tensor<T, S> three_term_stress(const T& a, const T& s, const T& p, const Tensor<T, S>& e, const T& second, const Tensor<T, S>& H, const T& j,
                               const T& inverse_J) noexcept {
  const Tensor<T, S> G = cofactor_minus_identity(H);
  if constexpr (S::confined) {
    Tensor<T, S> P = two_term_stress(a, p, H, G, j, inverse_J);
    if constexpr (S::dimension == 2) P(2, 2) = p - s * second;
    return P;
  } else {
    const Tensor<T, S> c = cofactor(e);
    const Tensor<T, S> tau = Tensor<T, S>::build_symmetric([&](int i, int k) {
      const T off = a * e(i, k) - s * c(i, k);
      return (i == k ? T(off + p) : off) * inverse_J;
    });
    return tau + tau * G;
  }
}

}  // namespace perikit
