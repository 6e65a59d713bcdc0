#pragma once
/// The functions of the standard library know neither packs nor numbers with derivatives. Called with one of them, each says in one line what to
/// write instead, where the compiler would print all of its overloads. (The standard reserves the namespace std. Nobody but an author of a part who
/// makes a mistake calls what is added to it here.)

#include <concepts>
#include <type_traits>

#include "perikit/core/simd.hpp"

namespace perikit {

template <class T>
struct Dual;

namespace detail {
template <class T>
inline constexpr bool unknown_to_std = std::same_as<T, Pack> || std::same_as<T, Product>;
template <class T>
inline constexpr bool unknown_to_std<Dual<T>> = true;

template <class T>
concept UnknownToStd = unknown_to_std<T>;
template <class A, class B>
concept OneUnknownToStd = UnknownToStd<A> || UnknownToStd<B>;
}  // namespace detail

#define PERIKIT_NOT_FOR_SCALARS(name, message)                      \
  template <perikit::detail::UnknownToStd T>                        \
  T name(const T& x) {                                              \
    static_assert(!perikit::detail::UnknownToStd<T>, message);      \
    return x;                                                       \
  }
#define PERIKIT_NOT_FOR_TWO_SCALARS(name, message)                  \
  template <perikit::detail::UnknownToStd T>                        \
  T name(const T& a, const T&) {                                    \
    static_assert(!perikit::detail::UnknownToStd<T>, message);      \
    return a;                                                       \
  }                                                                 \
  template <class A, class B>                                       \
  requires(perikit::detail::OneUnknownToStd<A, B> && !std::same_as<A, B>) A name(const A& a, const B&) { \
    static_assert(!perikit::detail::OneUnknownToStd<A, B>, message); \
    return a;                                                       \
  }
#define PERIKIT_WITHOUT_STD(name) "std::" #name " knows neither packs nor derivatives: write " #name " without std::, which perikit has for every scalar"
#define PERIKIT_INSTEAD(name, other) #name " knows neither packs nor derivatives: write " other ", which perikit has for every scalar"
#define PERIKIT_NO_SUCH(name) "there is no " #name " for packs and derivatives: framework/docs/scalars.md has the functions that there are"

// Also without std::, where they are found beside the scalars.
PERIKIT_NOT_FOR_SCALARS(fabs, PERIKIT_INSTEAD(fabs, "abs(x)"))
PERIKIT_NOT_FOR_TWO_SCALARS(fmin, PERIKIT_INSTEAD(fmin, "min(a, b)"))
PERIKIT_NOT_FOR_TWO_SCALARS(fmax, PERIKIT_INSTEAD(fmax, "max(a, b)"))

}  // namespace perikit

namespace std {

PERIKIT_NOT_FOR_SCALARS(sqrt, PERIKIT_WITHOUT_STD(sqrt))
PERIKIT_NOT_FOR_SCALARS(cbrt, PERIKIT_WITHOUT_STD(cbrt))
PERIKIT_NOT_FOR_SCALARS(exp, PERIKIT_WITHOUT_STD(exp))
PERIKIT_NOT_FOR_SCALARS(expm1, PERIKIT_WITHOUT_STD(expm1))
PERIKIT_NOT_FOR_SCALARS(log, PERIKIT_WITHOUT_STD(log))
PERIKIT_NOT_FOR_SCALARS(log1p, PERIKIT_WITHOUT_STD(log1p))
PERIKIT_NOT_FOR_SCALARS(tanh, PERIKIT_WITHOUT_STD(tanh))
PERIKIT_NOT_FOR_SCALARS(abs, PERIKIT_WITHOUT_STD(abs))
PERIKIT_NOT_FOR_SCALARS(fabs, PERIKIT_INSTEAD(std::fabs, "abs(x)"))
PERIKIT_NOT_FOR_TWO_SCALARS(min, PERIKIT_WITHOUT_STD(min))
PERIKIT_NOT_FOR_TWO_SCALARS(max, PERIKIT_WITHOUT_STD(max))
PERIKIT_NOT_FOR_TWO_SCALARS(pow, PERIKIT_WITHOUT_STD(pow))
PERIKIT_NOT_FOR_TWO_SCALARS(fmin, PERIKIT_INSTEAD(std::fmin, "min(a, b)"))
PERIKIT_NOT_FOR_TWO_SCALARS(fmax, PERIKIT_INSTEAD(std::fmax, "max(a, b)"))
PERIKIT_NOT_FOR_SCALARS(sin, PERIKIT_NO_SUCH(std::sin))
PERIKIT_NOT_FOR_SCALARS(cos, PERIKIT_NO_SUCH(std::cos))
PERIKIT_NOT_FOR_SCALARS(tan, PERIKIT_NO_SUCH(std::tan))
PERIKIT_NOT_FOR_SCALARS(asin, PERIKIT_NO_SUCH(std::asin))
PERIKIT_NOT_FOR_SCALARS(acos, PERIKIT_NO_SUCH(std::acos))
PERIKIT_NOT_FOR_SCALARS(atan, PERIKIT_NO_SUCH(std::atan))
PERIKIT_NOT_FOR_SCALARS(sinh, PERIKIT_NO_SUCH(std::sinh))
PERIKIT_NOT_FOR_SCALARS(cosh, PERIKIT_NO_SUCH(std::cosh))
PERIKIT_NOT_FOR_SCALARS(log10, PERIKIT_NO_SUCH(std::log10))
PERIKIT_NOT_FOR_SCALARS(log2, PERIKIT_NO_SUCH(std::log2))
PERIKIT_NOT_FOR_SCALARS(exp2, PERIKIT_NO_SUCH(std::exp2))
PERIKIT_NOT_FOR_TWO_SCALARS(atan2, PERIKIT_NO_SUCH(std::atan2))
PERIKIT_NOT_FOR_TWO_SCALARS(hypot, PERIKIT_NO_SUCH(std::hypot))
template <perikit::detail::UnknownToStd T, class A, class B>
T clamp(const T& x, const A&, const B&) {
  static_assert(!perikit::detail::UnknownToStd<T>, PERIKIT_INSTEAD(std::clamp, "min(max(x, lower), upper)"));
  return x;
}

}  // namespace std

#undef PERIKIT_NOT_FOR_SCALARS
#undef PERIKIT_NOT_FOR_TWO_SCALARS
#undef PERIKIT_WITHOUT_STD
#undef PERIKIT_INSTEAD
#undef PERIKIT_NO_SUCH
