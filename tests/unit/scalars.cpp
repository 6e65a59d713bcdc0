/// Whatever two scalars a law brings together: every operation compiles, and gives the value and the derivatives that it should. Values are compared
/// with those of doubles, derivatives with differences of them.

#include "perikit/sdk/law_checks.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <tuple>

using namespace perikit;

namespace {

using Real = long double;

/// x(s, t): a number, and how it changes along the two directions of Dual<Dual<T>>.
struct Path {
  double value, s, t, st;
  Real at(int depth, Real ds, Real dt) const {
    return value + (depth > 0 ? s * ds : 0) + (depth > 1 ? t * dt + st * ds * dt : 0);
  }
};

template <class T>
constexpr int depth_of = 0;
template <class T>
constexpr int depth_of<Dual<T>> = 1 + depth_of<T>;
template <class T>
constexpr bool has_lanes = std::same_as<T, Pack> || std::same_as<T, Product>;
template <class T>
constexpr bool has_lanes<Dual<T>> = has_lanes<T>;
template <class T>
std::string name_of() {
  if constexpr (depth_of<T> > 0) return "Dual<" + name_of<decltype(T::value)>() + ">";
  else if constexpr (has_lanes<T>) return std::same_as<T, Pack> ? "Pack" : "Product";
  else return std::integral<T> ? "int" : sizeof(T) == 4 ? "float" : "double";
}

/// The paths from number `first` on: one, or one in each lane.
template <class T, class Paths>
T made(const Paths& paths, int first, double Path::*value = &Path::value, double Path::*derivative = &Path::s) {
  if constexpr (depth_of<T> == 2) {
    using Inner = decltype(T::value);
    return T(made<Inner>(paths, first), made<Inner>(paths, first, &Path::t, &Path::st));
  } else if constexpr (depth_of<T> == 1) {
    using Inner = decltype(T::value);
    return T(made<Inner>(paths, first, value), made<Inner>(paths, first, derivative));
  } else if constexpr (has_lanes<T>) {
    Pack lanes;
    for (int l = 0; l < pack_width; ++l) lanes.v[l] = paths(first + l).*value;
    if constexpr (std::same_as<T, Product>) return lanes * 1.0;
    else return lanes;
  } else {
    return static_cast<T>(paths(first).*value);
  }
}

/// The number, its derivatives by s and by t, and the mixed one.
template <class T>
std::array<double, 4> parts(const T& x, int lane) {
  if constexpr (depth_of<T> == 2) {
    const auto value = parts(x.value, lane), derivative = parts(x.derivative, lane);
    return {value[0], value[1], derivative[0], derivative[1]};
  } else if constexpr (depth_of<T> == 1) {
    return {parts(x.value, lane)[0], parts(x.derivative, lane)[0], 0, 0};
  } else if constexpr (requires { x[lane]; }) {
    return {static_cast<double>(x[lane]), 0, 0, 0};
  } else {
    return {static_cast<double>(x), 0, 0, 0};
  }
}

/// The same of f(s, t), by differences.
template <class F>
std::array<double, 4> parts_by_differences(F&& f) {
  const Real h = 1e-4L;
  const auto d = [](Real x) { return static_cast<double>(x); };
  return {d(f(0, 0)), d((f(h, 0) - f(-h, 0)) / (2 * h)), d((f(0, h) - f(0, -h)) / (2 * h)),
          d((f(h, h) - f(h, -h) - f(-h, h) + f(-h, -h)) / (4 * h * h))};
}

void compare(const std::string& what, const std::array<double, 4>& found, const std::array<double, 4>& expected) {
  const std::string part[] = {"value", "derivative", "outer derivative", "second derivative"};
  for (std::size_t i = 0; i < 4; ++i)
    CHECK_MESSAGE(std::abs(found[i] - expected[i]) <= (i == 0 ? 4e-15 : 2e-6) * (1 + std::abs(expected[i])), what, ": ", part[i], " ", found[i], ", expected ",
                  expected[i]);
}

constexpr int trials = 8;

template <class A, class F, class G>
void check(const std::string& name, F operation, G exact, double lower, double upper) {
  const auto paths = [&](int i) { return Path{lower + (upper - lower) * (i % 16 + 0.3) / 16, 0.8, -0.6, 0.3}; };
  for (int trial = 0; trial < trials; ++trial) {
    const auto result = operation(made<A>(paths, trial));
    static_assert(depth_of<std::remove_cvref_t<decltype(result)>> == depth_of<A>);
    for (int lane = 0; lane < (has_lanes<A> ? pack_width : 1); ++lane) {
      const Path x = paths(trial + lane);
      compare(name + " of " + name_of<A>(), parts(result, lane), parts_by_differences([&](Real s, Real t) { return exact(x.at(depth_of<A>, s, t)); }));
    }
  }
}

/// Paths that cross: the first rises from lane to lane, the second falls. Whole numbers meet them where none of them is.
Path rising(int i) { return {1.15 + 0.45 * (i % 16), 0.8, -0.6, 0.3}; }
Path falling(int i) { return {7.37 - 0.4 * (i % 16), -0.5, 0.9, -0.2}; }

template <class A, class B, class F, class G>
void check_pair(const std::string& name, F operation, G exact) {
  for (int trial = 0; trial < trials; ++trial) {
    const A a = made<A>(rising, trial);
    const B b = made<B>(falling, trial);
    const auto result = operation(a, b);
    using Result = std::remove_cvref_t<decltype(result)>;
    constexpr bool answers = std::same_as<Result, bool> || std::same_as<Result, PackMask>;
    static_assert(answers ? std::same_as<Result, PackMask> == (has_lanes<A> || has_lanes<B>) : depth_of<Result> == std::max(depth_of<A>, depth_of<B>));
    for (int lane = 0; lane < (has_lanes<A> || has_lanes<B> ? pack_width : 1); ++lane) {
      const auto at = [&]<class T>(const T& number, const Path& path, Real s, Real t) -> Real {
        if constexpr (depth_of<T> > 0) return path.at(depth_of<T>, s, t);
        else return parts(number, lane)[0];
      };
      compare(name + " of " + name_of<A>() + " and " + name_of<B>(), parts(result, lane), parts_by_differences([&](Real s, Real t) {
                const auto of = exact(at(a, rising(trial + lane), s, t), at(b, falling(trial + lane), s, t));
                return static_cast<Real>(of);
              }));
    }
  }
}

template <class A, class B>
void check_pair() {
  check_pair<A, B>("<", [](const auto& a, const auto& b) { return a < b; }, [](Real a, Real b) { return a < b; });
  check_pair<A, B>("<=", [](const auto& a, const auto& b) { return a <= b; }, [](Real a, Real b) { return a <= b; });
  check_pair<A, B>(">", [](const auto& a, const auto& b) { return a > b; }, [](Real a, Real b) { return a > b; });
  check_pair<A, B>(">=", [](const auto& a, const auto& b) { return a >= b; }, [](Real a, Real b) { return a >= b; });
  check_pair<A, B>("==", [](const auto& a, const auto& b) { return a == b; }, [](Real a, Real b) { return a == b; });
  check_pair<A, B>("!=", [](const auto& a, const auto& b) { return a != b; }, [](Real a, Real b) { return a != b; });
  check_pair<A, B>("min", [](const auto& a, const auto& b) { return min(a, b); }, [](Real a, Real b) { return a < b ? a : b; });
  check_pair<A, B>("max", [](const auto& a, const auto& b) { return max(a, b); }, [](Real a, Real b) { return a > b ? a : b; });
  check_pair<A, B>("select", [](const auto& a, const auto& b) { return select(a > b, a, b); }, [](Real a, Real b) { return a > b ? a : b; });
  check_pair<A, B>("select by a bool", [](const auto& a, const auto& b) { return select(true, a, b); }, [](Real a, Real) { return a; });
  check_pair<A, B>("select of products", [](const auto& a, const auto& b) { return select(!(a < b), a * b, a + b); }, [](Real a, Real b) { return !(a < b) ? a * b : a + b; });
  check_pair<A, B>("+", [](const auto& a, const auto& b) { return a + b; }, [](Real a, Real b) { return a + b; });
  check_pair<A, B>("-", [](const auto& a, const auto& b) { return a - b; }, [](Real a, Real b) { return a - b; });
  check_pair<A, B>("*", [](const auto& a, const auto& b) { return a * b; }, [](Real a, Real b) { return a * b; });
  check_pair<A, B>("/", [](const auto& a, const auto& b) { return a / b; }, [](Real a, Real b) { return a / b; });
  check_pair<A, B>("pow", [](const auto& a, const auto& b) { return 1e-3 * pow(a, 0.25 * b); }, [](Real a, Real b) { return 1e-3 * std::pow(a, 0.25L * b); });
}

/// Two equal numbers.
template <class A, class B>
void check_equal() {
  const auto two = [](int) { return Path{2.0, 0.8, -0.6, 0.3}; };
  const A a = made<A>(two, 0);
  const B b = made<B>(two, 0);
  const std::string what = name_of<A>() + " and " + name_of<B>();
  for (int lane = 0; lane < (has_lanes<A> || has_lanes<B> ? pack_width : 1); ++lane) {
    const auto answers = [&](auto mask) { return parts(mask, lane)[0] == 1; };
    CHECK_MESSAGE((answers(a == b) && answers(a <= b) && answers(a >= b)), what);
    CHECK_MESSAGE(!(answers(a != b) || answers(a < b) || answers(a > b)), what);
  }
}

using OfDoubles = std::tuple<double, float, int, Dual<double>, Dual<Dual<double>>>;
using OfPacks = std::tuple<double, float, int, Pack, Product, Dual<Pack>, Dual<Dual<Pack>>>;

template <class... A>
void check_pairs(std::tuple<A...>*) {
  // Of two numbers of the language at least one is a double: others round otherwise.
  const auto with = []<class First, class Second>(First*, Second*) {
    if constexpr (!(std::is_arithmetic_v<First> && std::is_arithmetic_v<Second>) || std::same_as<First, double> || std::same_as<Second, double>)
      check_pair<First, Second>(), check_equal<First, Second>();
  };
  const auto with_all = [&]<class First>(First* first) { (with(first, static_cast<A*>(nullptr)), ...); };
  (with_all(static_cast<A*>(nullptr)), ...);
}

template <class A>
void check_functions() {
  check<A>("-", [](const auto& x) { return -x; }, [](Real x) { return -x; }, -2, 2);
  check<A>("abs", [](const auto& x) { return abs(x); }, [](Real x) { return std::abs(x); }, -2, 2);
  check<A>("sqrt", [](const auto& x) { return sqrt(x); }, [](Real x) { return std::sqrt(x); }, 0.2, 3);
  check<A>("cbrt", [](const auto& x) { return cbrt(x); }, [](Real x) { return std::cbrt(x); }, -2, 2);
  check<A>("exp", [](const auto& x) { return exp(x); }, [](Real x) { return std::exp(x); }, -2, 2);
  check<A>("expm1", [](const auto& x) { return expm1(x); }, [](Real x) { return std::expm1(x); }, -2, 2);
  check<A>("log", [](const auto& x) { return log(x); }, [](Real x) { return std::log(x); }, 0.2, 3);
  check<A>("log1p", [](const auto& x) { return log1p(x); }, [](Real x) { return std::log1p(x); }, -0.8, 2);
  check<A>("tanh", [](const auto& x) { return tanh(x); }, [](Real x) { return std::tanh(x); }, -2, 2);
  check<A>("reciprocal", [](const auto& x) { return reciprocal(x); }, [](Real x) { return 1 / x; }, 0.2, 3);
  check<A>("reciprocal_cbrt", [](const auto& x) { return reciprocal_cbrt(x); }, [](Real x) { return 1 / std::cbrt(x); }, 0.5, 3);
  check<A>("pow 3", [](const auto& x) { return pow(x, 3); }, [](Real x) { return x * x * x; }, -2, 2);
  check<A>("pow -2", [](const auto& x) { return pow(x, -2); }, [](Real x) { return 1 / (x * x); }, 0.3, 2);
  check<A>("pow 3.0", [](const auto& x) { return pow(x, 3.0); }, [](Real x) { return x * x * x; }, -2, 2);
  check<A>("pow -2/3", [](const auto& x) { return pow(x, -2.0 / 3); }, [](Real x) { return std::pow(x, Real(-2.0 / 3)); }, 0.4, 2);
  check<A>("pow of 2", [](const auto& x) { return pow(2, x); }, [](Real x) { return std::pow(Real(2), x); }, -1, 2);
  check<A>("rational_power", [](const auto& x) { return rational_power<-2, 3>(x); }, [](Real x) { return std::pow(x, -2.0L / 3); }, 0.4, 2);
  check<A>("integer_power", [](const auto& x) { return integer_power<3>(x); }, [](Real x) { return x * x * x; }, -2, 2);
}

/// The law of framework/docs/scalars.md.
struct SplitLaw {
  static constexpr MaterialTraits traits{.constants = 3, .objective = false};
  void constants(const MaterialInput&, double* k) const { k[0] = 1, k[1] = 2, k[2] = 5; }
  Moduli small_strain(const double* k) const noexcept { return {k[1], k[0]}; }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, tension, compression] = k;
    const Tensor<T, S> strain = symmetric_part(H);
    const T j = trace(H);
    const T bulk = select(j < 0.0, compression, tension);
    return mu * inner(strain, strain) + 0.5 * bulk * (j * j);
  }
};

double lane(Pack x) { return x[0]; }

}  // namespace

TEST_CASE("two scalars of a law: comparisons, choices and arithmetic, with derivatives") {
  check_pairs(static_cast<OfDoubles*>(nullptr));
  check_pairs(static_cast<OfPacks*>(nullptr));
}

TEST_CASE("functions of every scalar, with derivatives") {
  check_functions<double>();
  check_functions<Dual<double>>();
  check_functions<Dual<Dual<double>>>();
  check_functions<Pack>();
  check_functions<Product>();
  check_functions<Dual<Pack>>();
  check_functions<Dual<Dual<Pack>>>();
}

TEST_CASE("masks are joined with each other and with conditions that all lanes share") {
  Pack x;
  for (int l = 0; l < pack_width; ++l) x.v[l] = l;
  const PackMask low = x < 1, high = x >= 1;
  for (const bool b : {false, true}) {
    CHECK(lane_bits(low & b) == (b ? lane_bits(low) : 0));
    CHECK(lane_bits(b & low) == (b ? lane_bits(low) : 0));
    CHECK(lane_bits(low | b) == (b ? lane_bits(low | high) : lane_bits(low)));
    CHECK(lane_bits(b | low) == (b ? lane_bits(low | high) : lane_bits(low)));
    CHECK(any(b) == b);
    CHECK(all(b) == b);
  }
  CHECK(all(low | high));
  CHECK(!any(low & high));
  CHECK(!all(low));
}

TEST_CASE("scalars are changed in place by numbers, constants and their like") {
  const auto change = []<class T>(T x) {
    const Pack p = 2.0;
    x += 1;
    x -= 0.5f;
    x *= 4.0;
    x /= x + 1;
    if constexpr (has_lanes<T>) x += p * p, x *= p;
    return x;   // (x + 1/2) 4 / ((x + 1/2) 4 + 1), and 4 more, times 2
  };
  CHECK(std::abs(change(1.0) - 6.0 / 7) < 1e-15);
  CHECK(std::abs(change(Dual<double>(1, 1)).derivative - 4.0 / 49) < 1e-15);
  CHECK(std::abs(change(Pack(1.0))[0] - (6.0 / 7 + 4) * 2) < 1e-14);
  const Dual<Dual<Pack>> found = change(Dual<Dual<Pack>>(Dual<Pack>(1, 1), Dual<Pack>(1, 0)));
  CHECK(std::abs(found.value.derivative[0] - 8.0 / 49) < 1e-15);
  CHECK(std::abs(found.derivative.derivative[0] + 64.0 / 343) < 1e-15);
}

TEST_CASE("where two are equal, and at zero") {
  const Dual<double> a(1, 2), b(1, 3);
  CHECK(min(a, b).derivative == 3);   // the second
  CHECK(max(a, b).derivative == 3);
  CHECK(max(a, 1.0).derivative == 0);
  CHECK(a == b);                      // by their values
  CHECK(abs(Dual<double>(0, 2)).derivative == 2);
  CHECK(pow(Dual<double>(0, 2), 2).derivative == 0);
  CHECK(pow(Dual<Pack>(0, 2), 1).derivative[0] == 2);
}

TEST_CASE("tensors times and over scalars, from both sides") {
  const auto check_tensor = []<class T>(T scale) {
    const auto a = Tensor<T, Plane>::map([](int k) { return T(k + 1.0); });
    for (int c = 0; c < Plane::components; ++c) {
      const double expected = 2.0 * (c + 1);
      for (const auto& b : {scale * a, a * scale, a * 2, 2.0 * a, -(a * -2.0), a / 0.5, (a * (scale * scale)) / scale}) CHECK(parts(T(b[c]), 0)[0] == expected);
    }
  };
  check_tensor(2.0);
  check_tensor(Pack(2.0));
  check_tensor(Dual<Pack>(2.0, 1.0));
  check_tensor(Dual<Dual<Pack>>(2.0));
}

TEST_CASE("a law that branches: its stress is that of each point's branch") {
  const std::array<Pack, 3> k{1.0, 2.0, 5.0};
  Pack stretch;
  for (int l = 0; l < pack_width; ++l) stretch.v[l] = l % 2 == 0 ? 0.01 * (l + 1) : -0.01 * (l + 1);
  const auto H = Tensor<Pack, Solid>::map([&](int c) { return c == 0 ? stretch : Pack(0.0); });
  static_assert(detail::check_law<SplitLaw>());
  const Tensor<Pack, Solid> P = stress(SplitLaw(), H, k), A = tangent(SplitLaw(), H, k)(Tensor<Pack, Solid>::unit(0));
  for (int l = 0; l < pack_width; ++l) {
    const double bulk = l % 2 == 0 ? 2 : 5;
    CHECK(std::abs(P[0][l] - (2 + bulk) * stretch[l]) < 1e-15);
    CHECK(std::abs(P[4][l] - bulk * stretch[l]) < 1e-15);
    CHECK(std::abs(A[0][l] - (2 + bulk)) < 1e-14);
  }
}

TEST_CASE("a choice behind a root has a derivative, one before it has none") {
  const auto behind = [](const auto& x) { return select(x > 0.0, sqrt(x), 0.0); };
  const auto before = [](const auto& x) { return sqrt(max(x, 0.0)); };
  for (const double x : {-1.0, 0.0}) {
    CHECK(behind(Dual<double>(x, 1)).derivative == 0);
    CHECK(behind(Dual<Dual<Pack>>(Dual<Pack>(x, 1), Dual<Pack>(1))).derivative.derivative[0] == 0);
    CHECK(std::isnan(before(Dual<double>(x, 1)).derivative));
  }
}

TEST_CASE("powers of packs") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> logarithm(-20, 20), exponents(-8, 8);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = std::exp(logarithm(random)), p = exponents(random);
    const long double exact = std::pow(static_cast<long double>(x), static_cast<long double>(p));
    const double error = static_cast<double>(std::abs(lane(pow(Pack(x), p)) / exact - 1)) / std::numeric_limits<double>::epsilon();
    worst = std::max(worst, error / (std::abs(p * std::log(x)) + 2));
  }
  CHECK_MESSAGE(worst <= 1, worst);
  for (const double x : {-3.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0})
    for (const double p : {-3.0, -2.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0}) {
      const double exact = std::pow(x, p), found = lane(pow(Pack(x), p));
      CHECK_MESSAGE((std::isnan(exact) ? std::isnan(found) : found == exact || std::abs(found / exact - 1) < 4e-15), x, "^", p, ": ", found);
    }
  CHECK(lane(pow(Pack(1.5), 5)) == 1.5 * 1.5 * 1.5 * 1.5 * 1.5);
  CHECK(std::isnan(lane(pow(Pack(std::numeric_limits<double>::quiet_NaN()), 2.0))));
}
