#pragma once
/// Plane and uniaxial stress: the stretch normal to the body is not given but follows from zero stress normal to it.

#include <array>
#include <concepts>
#include <limits>
#include <utility>

#include "perikit/sdk/differentiation.hpp"

namespace perikit {

/// The direction that is free: zz of a plane, yy + zz of a line (equal for an isotropic law).
template <class T, class S>
Tensor<T, S> free_direction() noexcept {
  return Tensor<T, S>::build([](int i, int j) { return T(i == j && i >= S::dimension ? 1.0 : 0.0); });
}

/// a <- a with s along the free axes, without a copy of the tensor.
template <class T, class S, class U>
void put_free_part(Tensor<T, S>& a, const U& s) noexcept {
  for (int i = S::dimension; i < 3; ++i) a(i, i) = s;
}
template <class T, class S, class U>
Tensor<T, S> with_free_part(Tensor<T, S> a, const U& s) noexcept {
  put_free_part(a, s);
  return a;
}

/// Stress along the free axes by the strain along them where the others are held, of a linear law: lambda + 2 mu, of a bar, whose free axes
/// strain together, 2 (lambda + mu). lambda over it is the lateral contraction.
template <class S, class T>
T free_modulus(const T& lambda, const T& mu) noexcept {
  static_assert(S::dimension < 3);
  return S::dimension == 2 ? T(lambda + 2.0 * mu) : T(2.0 * (lambda + mu));
}

/// The largest component.
template <class S>
Pack largest(const Tensor<Pack, S>& H) noexcept {
  Pack size = 0.0;
  for (int c = 0; c < S::components; ++c) size = max(size, abs(H[c]));
  return size;
}

/// Lateral contraction at F = I in the sense of logarithmic strains, -d ln(free stretch) / d ln(J in the body's space).
template <class S, class Law, class K>
Pack contraction_ratio(const Law& law, const K& k) noexcept {
  const auto q = tangent(law, Tensor<Pack, S>::map([](int) { return Pack(0.0); }), k)(free_direction<Pack, S>());
  return q[0] / inner(free_direction<Pack, S>(), q);
}

/// In laws linear in a measure of strain, stress in the body's space under zero lateral stress is that under zero lateral strain with other constants:
/// law.free_constants<S>(k) of these, S confined. The law has free_stretch(H, k), too, with its own constants and H without lateral strain, and, where
/// not every admissible H has one, stretches_freely(H, k) -> lanes that have.
template <class Law, class S, class K>
concept HasFreeConstants = requires(const Law& law, const K& k) {
  { law.template free_constants<S>(k) } -> std::same_as<K>;
};
/// Of isotropic laws of that kind, whose constants are lambda and mu: 2 lambda mu/(lambda + 2 mu), in a bar lambda mu/(lambda + mu), and mu.
template <class S, class K>
K free_lame(const K& k) noexcept {
  const auto& [lambda, mu] = k;
  return {(2.0 * mu) * lambda / free_modulus<S>(lambda, mu), mu};
}

/// Kirchhoff stress along a free axis, and its derivative by the logarithm of the free stretch.
template <class T>
struct FreeStress {
  T value, slope;
};

/// Laws may know the free stretch in closed form: law.free_stretch(H, k) -> H33, from the in-plane components of H, NaN where there is none;
template <class Law, class T, class S, class K>
concept HasFreeStretch = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.free_stretch(H, k) } -> std::same_as<T>;
};
/// or its equation, by invariants instead of tensors: law.free_stress(H, k) returns H33 -> FreeStress<T>.
template <class Law, class T, class S, class K>
concept HasFreeStress = requires(const Law& law, const Tensor<T, S>& H, const K& k, const T& h) {
  { law.free_stress(H, k)(h) } -> std::same_as<FreeStress<T>>;
};

/// Laws may know the tangent under zero free stress: law.free_tangent(H, k) returns dH -> dP, H with its free strain; free components of dH are zero,
/// those of dP are not read.
template <class Law, class T, class S, class K>
concept HasFreeTangent = S::dimension < 3 && requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.free_tangent(H, k)(H) } -> std::same_as<Tensor<T, S>>;
};

/// An equation may solve itself: zeros(several of it, what rest() of each gives, h, q) -> H33, NaN where it does not, and the cube root q
/// of J; stress(H, q) is P there, tangent(H, q) dH -> dP as of HasFreeTangent.
template <class Law, class T, class S, class K>
concept HasFreeZeros = requires(const Law& law, const Tensor<T, S>& H, const K& k, T& q) {
  law.free_stress(H, k).zeros(std::array{law.free_stress(H, k)}, std::array{law.free_stress(H, k).rest()}, &q, &q);
  { law.free_stress(H, k).stress(H, q) } -> std::same_as<Tensor<T, S>>;
};

/// The free Kirchhoff stress of any law, over the free stretch: slope d(x residual)/dy over x.
template <class Law, class S, class K>
auto free_stress_of(const Law& law, const Tensor<Pack, S>& H, const K& k) noexcept {
  if constexpr (HasFreeStress<Law, Pack, S, K>) {
    return law.free_stress(H, k);
  } else {
    return [&law, H, &k](const Pack& h) {
      const Tensor<Pack, S> N = free_direction<Pack, S>(), at = with_free_part(H, h);
      const Pack residual = inner(N, stress(law, at, k)), stiffness = inner(N, tangent(law, at, k)(N));
      return FreeStress<Pack>{residual, residual + (1.0 + h) * stiffness};
    };
  }
}

/// The zero of the free stress in the lanes that are `active`; those without one stay active. Newton in the logarithm y of
/// the stretch, where rubber laws are nearly linear, kept inside a bracket; each lane stops on its own. size: of H.
template <class Equation>
Pack solve_free_equation(const Equation& equation, Pack y, Pack size, PackMask& active) noexcept {
  constexpr int max_iterations = 80;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Pack h = expm1(y), lower = -infinity, upper = infinity;
  for (int iteration = 0; iteration < max_iterations && any(active); ++iteration) {
    const FreeStress<Pack> stress = equation(h);
    const Pack residual = stress.value, slope = stress.slope, x = 1.0 + h;
    const PackMask low = residual<0.0, high = residual> 0.0;
    lower = select(low & active, y, lower);
    upper = select(high & active, y, upper);
    const Pack newton = min(max(-residual / slope, Pack(-1.0)), Pack(1.0));
    Pack step = select(slope > 0.0, newton, select(low, Pack(1.0), Pack(-1.0)));
    step = select(low & (y + step > upper), 0.5 * (upper - y), step);
    step = select(high & (y + step < lower), 0.5 * (lower - y), step);
    step = select(residual == 0.0, Pack(0.0), step);
    y = select(active, y + step, y);
    h = select(active, h + x * expm1(step), h);
    // Convergence is quadratic: the step just taken is the last that matters. Laws written in F have no zero closer than rounding.
    active &= abs(step) > max(1e-8 * size, Pack(4 * std::numeric_limits<double>::epsilon()));
  }
  return h;
}

/// H without its free components, and zero where it is not finite or, but for small-strain laws, not 0 < det F < infinity: there
/// `good` turns false.
template <bool small_strain, class S>
Tensor<Pack, S> admissible_given_part(Tensor<Pack, S> H, PackMask& good) noexcept {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  put_free_part(H, Pack(0.0));
  const Pack j = jacobian_minus_one(H);
  if constexpr (!small_strain) good &= (j > -1.0) & (j < infinity);
  good &= largest(H) < infinity;
  return Tensor<Pack, S>::map([&](int c) { return select(good, H[c], Pack(0.0)); });
}

/// The free strain where the free stress vanishes to rounding, in the lanes that are `good`; lanes without a solution are taken from
/// them. H: of admissible_given_part. Where the law does not know better, Newton from the exact solution for a Kirchhoff stress
/// linear in the logarithmic strain.
template <bool small_strain, class Law, class S, class K>
Pack free_strain(const Law& law, const Tensor<Pack, S>& H, const K& k, Pack ratio, PackMask& good) noexcept {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Pack h = 0.0;
  if constexpr (HasFreeStretch<Law, Pack, S, K>) {
    h = law.free_stretch(H, k);
    good &= small_strain ? abs(h) < infinity : (h > -1.0) & (h < infinity);
  } else if constexpr (small_strain) {
    const Tensor<Pack, S> N = free_direction<Pack, S>();
    const Pack size = largest(H);
    PackMask active = good;
    for (int iteration = 0; iteration < 80 && any(active); ++iteration) {
      const Tensor<Pack, S> at = with_free_part(H, h);
      const Pack step = -inner(N, stress(law, at, k)) / inner(N, tangent(law, at, k)(N));
      h = select(active, h + step, h);
      active &= abs(step) > 1e-8 * size;
    }
    good &= !active;
  } else {
    PackMask active = good;
    h = solve_free_equation(free_stress_of(law, H, k), -ratio * log1p(jacobian_minus_one(H)), largest(H), active);
    good &= !active;
  }
  return select(good, h, Pack(0.0));
}

/// Sixteen points, or as many as the registers hold what they need.
inline constexpr int free_zero_packs = pack_width == 8 ? 2 : 4;

/// Free strains of some packs of points at a time, and what the stress takes from them, of laws with HasFreeZeros.
template <class Law, class S, class K>
class FreeZeros {
 public:
  using Equation = decltype(std::declval<const Law&>().free_stress(Tensor<Pack, S>(), std::declval<const K&>()));
  static constexpr int packs = free_zero_packs;
  std::array<Equation, packs> equation;
  Pack strain[packs], root[packs];  ///< strain: not a number where there is none

  /// uniform: all packs have the same constants; begun: and had them in the last call.
  template <class Given>
  void find(const Law& law, const std::array<K, packs>& k, bool uniform, bool begun, const Given& given) noexcept {
    for (int i = 0; i < packs; ++i) equation[i] = law.free_stress(given(i), k[i]);
    if (!uniform)
      for (int i = 0; i < packs; ++i) rest_[i] = equation[i].rest();
    else if (!begun)
      rest_.fill(equation[0].rest());
    Equation::zeros(equation, rest_, strain, root);
    for (int i = 0; i < packs; ++i)
      if (!all(strain[i] == strain[i])) [[unlikely]]
        find_step_by_step(law, k[i], given(i), i);
  }

 private:
  [[gnu::noinline, gnu::cold]] void find_step_by_step(const Law& law, const K& k, const Tensor<Pack, S>& whole, int i) noexcept {
    PackMask good = Pack(0.0) == Pack(0.0);
    const Tensor<Pack, S> H = admissible_given_part<false>(whole, good);
    const PackMask found = strain[i] == strain[i];
    strain[i] = select(found, strain[i], free_strain<false>(law, H, k, contraction_ratio<S>(law, k), good));
    const Pack free = 1.0 + strain[i], area = S::dimension == 2 ? free : Pack(free * free);
    root[i] = select(found, root[i], cbrt((1.0 + jacobian_minus_one(H)) * area));  // a product keeps the digits of small volumes
    strain[i] = select(good, strain[i], Pack(std::numeric_limits<double>::quiet_NaN()));
  }

  std::array<typename Equation::Rest, packs> rest_;
};

/// dH -> dP under zero free stress: dP = A : (dH + N dh) with N : dP = 0. Free components of dH are zero.
template <class Law, class S, class K>
auto condensed_tangent(const Law& law, const Tensor<Pack, S>& H, const K& k) noexcept {
  auto full = tangent(law, H, k);
  const Tensor<Pack, S> N = free_direction<Pack, S>(), q = full(N);
  return [full, N, q, inverse = 1.0 / inner(N, q)](const Tensor<Pack, S>& dH) {
    const Tensor<Pack, S> dP = full(with_free_part(dH, Pack(0.0)));
    return with_free_part(dP - (inner(N, dP) * inverse) * q, Pack(0.0));
  };
}

}  // namespace perikit
