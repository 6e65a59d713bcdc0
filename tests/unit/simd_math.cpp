#include "perikit/core/simd_math.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "perikit/core/dual.hpp"

using namespace perikit;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double smallest = std::numeric_limits<double>::denorm_min();

/// Error in units of the last place of the exact value.
double ulps(double found, long double exact) {
  const double nearest = static_cast<double>(exact);
  if (std::isnan(nearest)) return std::isnan(found) ? 0 : infinity;
  if (nearest == found) return 0;
  if (std::isinf(nearest) || !std::isfinite(found)) return infinity;
  const double magnitude = std::abs(nearest);
  const double unit = std::max(std::nextafter(magnitude, infinity) - magnitude, smallest);
  return static_cast<double>(std::abs((static_cast<long double>(found) - exact) / unit));
}

template <class F, class G>
void compare(const std::string& name, F packed, G exact, const std::vector<double>& arguments, double allowed = 2.0) {
  double worst = 0, where = 0;
  for (std::size_t i = 0; i < arguments.size(); i += pack_width) {
    double in[pack_width], out[pack_width];
    for (int l = 0; l < pack_width; ++l) in[l] = arguments[std::min(i + l, arguments.size() - 1)];
    packed(Pack::load(in)).store(out);
    for (int l = 0; l < pack_width; ++l) {
      const double e = ulps(out[l], exact(static_cast<long double>(in[l])));
      if (!(e <= worst)) worst = e, where = in[l];
    }
  }
  CHECK_MESSAGE(worst <= allowed, name, ": ", worst, " units in the last place at ", where);
}

/// Both signs, all binary exponents in [from, to), and the special values.
std::vector<double> arguments(int from, int to, int count = 200000) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> mantissa(1, 2);
  std::uniform_int_distribution<int> exponent(from, to - 1), sign(0, 1);
  std::vector<double> r{0.0,
                        -0.0,
                        1.0,
                        -1.0,
                        2.0,
                        0.5,
                        infinity,
                        -infinity,
                        not_a_number,
                        smallest,
                        -smallest,
                        std::numeric_limits<double>::min(),
                        std::numeric_limits<double>::max(),
                        -std::numeric_limits<double>::max(),
                        1 - 0x1p-53,
                        1 + 0x1p-52,
                        std::sqrt(0.5),
                        std::sqrt(2.0),
                        8.0,
                        27.0,
                        -1 + 0x1p-53};
  for (int i = 0; i < count; ++i) r.push_back((sign(random) ? 1 : -1) * std::ldexp(mantissa(random), exponent(random)));
  return r;
}

std::vector<double> between(double a, double b, int count = 200000) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> value(a, b);
  std::vector<double> r;
  for (int i = 0; i < count; ++i) r.push_back(value(random));
  return r;
}

#define PERIKIT_COMPARE(f, arguments) \
  compare(                            \
      #f, [](Pack x) { return f(x); }, [](long double x) { return std::f(x); }, arguments)

}  // namespace

TEST_CASE("logarithms over the whole range, near one and near zero") {
  PERIKIT_COMPARE(log, arguments(-1074, 1024));
  PERIKIT_COMPARE(log, between(0.4, 2.6));
  PERIKIT_COMPARE(log, between(1 - 1e-6, 1 + 1e-6));
  PERIKIT_COMPARE(log1p, arguments(-1074, 1024));
  PERIKIT_COMPARE(log1p, arguments(-60, 4));
  PERIKIT_COMPARE(log1p, between(-1, 3));
}

TEST_CASE("exponentials over the whole range, and near zero") {
  PERIKIT_COMPARE(exp, arguments(-1074, 1024));
  PERIKIT_COMPARE(exp, between(-750, 715));
  PERIKIT_COMPARE(exp, between(-3, 3));
  PERIKIT_COMPARE(expm1, arguments(-1074, 1024));
  PERIKIT_COMPARE(expm1, between(-60, 715));
  PERIKIT_COMPARE(expm1, between(-2, 2));
  PERIKIT_COMPARE(expm1, arguments(-60, 3));
  const auto packed = [](Pack x) { return tanh(x); };
  const auto exact = [](long double x) { return std::tanh(x); };
  for (const auto& some : {arguments(-1074, 1024), between(-25, 25), between(-1, 1)}) compare("tanh", packed, exact, some, 3.0);
}

TEST_CASE("roots and rational powers") {
  PERIKIT_COMPARE(cbrt, arguments(-1074, 1024));
  PERIKIT_COMPARE(cbrt, between(-8, 8));
  PERIKIT_COMPARE(sqrt, arguments(-1074, 1024));
  const std::vector<double> x = between(1e-3, 200);
  compare(
      "x^(-2/3)", [](Pack a) { return rational_power<-2, 3>(a); }, [](long double a) { return std::cbrt(1 / (a * a)); }, x);
  compare(
      "x^(2/3)", [](Pack a) { return rational_power<2, 3>(a); }, [](long double a) { return std::cbrt(a * a); }, x);
  compare(
      "x^(-1/3)", [](Pack a) { return rational_power<-1, 3>(a); }, [](long double a) { return 1 / std::cbrt(a); }, x);
  for (const auto& some : {between(1e-300, 1e300), x, arguments(-1000, 1000)}) {
    std::vector<double> positive;
    for (const double a : some) positive.push_back(std::clamp(std::abs(a), 1e-300, 1e300));
    compare(
        "reciprocal", [](Pack a) { return reciprocal(a); }, [](long double a) { return 1 / a; }, positive, 1.5);
    compare(
        "1/sqrt(a)", [](Pack a) { return reciprocal_root(a); }, [](long double a) { return 1 / std::sqrt(a); }, positive, 1.5);
  }
  CHECK(!(reciprocal_root(Pack(std::numeric_limits<double>::infinity()))[0] > 0));
  compare(
      "reciprocal_cbrt", [](Pack a) { return reciprocal_cbrt(a); }, [](long double a) { return 1 / std::cbrt(a); }, between(1e-300, 1e300), 4.0);
  compare(
      "reciprocal_cbrt", [](Pack a) { return reciprocal_cbrt(a); }, [](long double a) { return 1 / std::cbrt(a); }, x, 4.0);
  compare(
      "x^(5/3)", [](Pack a) { return rational_power<5, 3>(a); }, [](long double a) { return a * std::cbrt(a * a); }, x, 3.0);
  compare(
      "x^(-4/3)", [](Pack a) { return rational_power<-4, 3>(a); }, [](long double a) { return 1 / (a * std::cbrt(a)); }, x, 3.0);
  compare(
      "x^(-3/2)", [](Pack a) { return rational_power<-3, 2>(a); }, [](long double a) { return 1 / (a * std::sqrt(a)); }, x, 3.0);
  compare(
      "x^(1/2)", [](Pack a) { return rational_power<1, 2>(a); }, [](long double a) { return std::sqrt(a); }, x);
  compare(
      "x^3", [](Pack a) { return rational_power<3, 1>(a); }, [](long double a) { return a * a * a; }, x);
}

TEST_CASE("a lane does not see its neighbours") {
  const std::vector<double> x = arguments(-300, 300, 64);
  // through one compiled body: the compiler may round differently (fuse or not) in another copy
  for (Pack (*volatile f)(Pack) :
       {+[](Pack a) { return log(a); }, +[](Pack a) { return exp(a); }, +[](Pack a) { return cbrt(a); }})
    for (std::size_t i = 0; i + pack_width <= x.size(); i += pack_width)
      for (int l = 0; l < pack_width; ++l) {
        const double together = f(Pack::load(&x[i]))[l], alone = f(Pack(x[i + l]))[0];
        CHECK((std::bit_cast<std::uint64_t>(together) == std::bit_cast<std::uint64_t>(alone) ||
               (std::isnan(together) && std::isnan(alone))));
      }
}

TEST_CASE("duals differentiate every function, and twice") {
  const auto check = [](const std::string& name, auto f, auto slope, auto curvature) {
    for (const double x : {0.3, 0.9, 1.7}) {
      using Second = Dual<Dual<double>>;
      const Second y = f(Second{{x, 1.0}, {1.0, 0.0}});
      CHECK_MESSAGE(std::abs(y.value.derivative - slope(x)) <= 1e-13 * (1 + std::abs(slope(x))), name, " at ", x);
      CHECK_MESSAGE(std::abs(y.derivative.derivative - curvature(x)) <= 1e-13 * (1 + std::abs(curvature(x))), name, " twice at ",
                    x);
    }
  };
  check(
      "sqrt", [](auto x) { return sqrt(x); }, [](double x) { return 0.5 / std::sqrt(x); },
      [](double x) { return -0.25 * std::pow(x, -1.5); });
  check(
      "cbrt", [](auto x) { return cbrt(x); }, [](double x) { return std::pow(x, -2.0 / 3) / 3; },
      [](double x) { return -2.0 / 9 * std::pow(x, -5.0 / 3); });
  check(
      "log", [](auto x) { return log(x); }, [](double x) { return 1 / x; }, [](double x) { return -1 / (x * x); });
  check(
      "log1p", [](auto x) { return log1p(x); }, [](double x) { return 1 / (1 + x); },
      [](double x) { return -1 / ((1 + x) * (1 + x)); });
  check(
      "exp", [](auto x) { return exp(x); }, [](double x) { return std::exp(x); }, [](double x) { return std::exp(x); });
  check(
      "expm1", [](auto x) { return expm1(x); }, [](double x) { return std::exp(x); }, [](double x) { return std::exp(x); });
  check(
      "tanh", [](auto x) { return tanh(x); }, [](double x) { return 1 - std::tanh(x) * std::tanh(x); },
      [](double x) { return -2 * std::tanh(x) * (1 - std::tanh(x) * std::tanh(x)); });
  check(
      "quotient", [](auto x) { return (1.0 + x) / (2.0 - x * x); },
      [](double x) { return (x * x + 2 * x + 2) / ((2 - x * x) * (2 - x * x)); },
      [](double x) {
        const double q = 2 - x * x;
        return (2 * x + 2) / (q * q) + 4 * x * (x * x + 2 * x + 2) / (q * q * q);
      });
  check(
      "power", [](auto x) { return rational_power<-2, 3>(x); }, [](double x) { return -2.0 / 3 * std::pow(x, -5.0 / 3); },
      [](double x) { return 10.0 / 9 * std::pow(x, -8.0 / 3); });
}
