#include "perikit/model/elastic_constants.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "tests/kit/messages.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

using Given = std::map<std::string, double, std::less<>>;

Moduli convert(const Given& given) {
  return elastic_constants(
      {[&](std::string_view k) { return given.contains(k); }, [&](std::string_view k) { return given.find(k)->second; }});
}

std::string refusal(const Given& given) {
  return message_of<std::domain_error>([&] { convert(given); });
}

}  // namespace

TEST_CASE("any two elastic constants give the same solid") {
  for (const double nu : {-0.9, -0.3, 0.2, 0.25, 0.45, 0.49999}) {
    const double mu = 0.8, lambda = 2 * mu * nu / (1 - 2 * nu), bulk = lambda + 2 * mu / 3, E = 2 * mu * (1 + nu);
    const Given all{
        {"youngs_modulus", E}, {"poisson_ratio", nu}, {"shear_modulus", mu}, {"bulk_modulus", bulk}, {"lame_lambda", lambda}};
    for (auto a = all.begin(); a != all.end(); ++a)
      for (auto b = std::next(a); b != all.end(); ++b) {
        // E and lambda have two solids where nu < -1/4: the one with the larger shear modulus is taken
        if (nu < -0.25 && contains(a->first + b->first, "lame") && contains(a->first + b->first, "young")) continue;
        const Moduli m = convert({*a, *b});
        const double sensitivity = 1 / (1 - 2 * nu) + 1 / (1 + nu);  // of mu to the pairs that do not hold it
        CHECK_MESSAGE(std::abs(m.mu - mu) <= 1e-14 * mu * sensitivity, a->first, ", ", b->first, ", nu = ", nu, ": mu ", m.mu);
        CHECK_MESSAGE(std::abs(m.lambda - lambda) <= 1e-14 * (std::abs(lambda) + mu) * sensitivity * sensitivity, a->first, ", ",
                      b->first, ", nu = ", nu, ": lambda ", m.lambda);
      }
  }
}

TEST_CASE("constants that are no solid are refused by name") {
  CHECK(contains(refusal({{"youngs_modulus", 1.0}, {"poisson_ratio", 0.5}}),
                 "found poisson_ratio = 0.5; allowed: a value > -1 and < 0.5"));
  CHECK(contains(refusal({{"youngs_modulus", 1.0}, {"poisson_ratio", -1.0}}), "found poisson_ratio = -1"));
  CHECK(contains(refusal({{"youngs_modulus", -1.0}, {"poisson_ratio", 0.2}}), "found youngs_modulus = -1; allowed: a value > 0"));
  CHECK(contains(refusal({{"shear_modulus", 0.0}, {"bulk_modulus", 1.0}}), "found shear_modulus = 0"));
  CHECK(contains(refusal({{"shear_modulus", 1.0}, {"lame_lambda", -1.0}}), "bulk_modulus"));
  CHECK(contains(refusal({{"youngs_modulus", 3.0}, {"shear_modulus", 1.0}}),
                 "allowed: a finite value > 0 from the two constants given"));
  CHECK(contains(refusal({{"poisson_ratio", 0.3}, {"lame_lambda", -1.0}}), "found lame_lambda = -1"));
  CHECK(contains(refusal({{"poisson_ratio", 0.0}, {"lame_lambda", 0.0}}), "found lame_lambda = 0"));
  CHECK(contains(refusal({{"youngs_modulus", NAN}, {"poisson_ratio", 0.3}}),
                 "found youngs_modulus = nan; allowed: a finite value"));
  CHECK(contains(refusal({{"youngs_modulus", 1.0}}), "found 1 elastic constants; allowed: exactly two of"));
}
