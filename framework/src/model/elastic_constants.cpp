#include "perikit/model/elastic_constants.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace perikit {
namespace {

[[noreturn]] void refuse(std::string_view name, double value, std::string_view allowed) {
  throw std::domain_error(fmt::format("found {} = {}; allowed: {}", name, value, allowed));
}

/// Below and beyond, squares and products of moduli are no numbers any more.
constexpr double least = 1e-100, most = 1e100;
/// Of 1 - 2 nu, and of what else is a small difference of given numbers: with less, rounding decides the bulk modulus.
constexpr double smallest_difference = 1e-12;

double positive(std::string_view name, double value) {
  if (!(value > 0)) refuse(name, value, "a value > 0");
  if (value < least || value > most) refuse(name, value, fmt::format("a value between {} and {}", least, most));
  return value;
}

Moduli from_shear_and_bulk(double mu, double bulk) {
  return {bulk - 2 * mu / 3, mu};
}
Moduli from_young_and_shear(double E, double mu) {
  return {mu * (E - 2 * mu) / (3 * mu - E), mu};
}

/// mu = (E - 3 lambda + R)/4 with R = sqrt(E^2 + 9 lambda^2 + 2 E lambda), without cancellation.
Moduli from_young_and_lambda(double E, double lambda) {
  const double R = std::sqrt(E * E + 9 * lambda * lambda + 2 * E * lambda);
  return {lambda, 3 * lambda > E ? 2 * E * lambda / (R + 3 * lambda - E) : (E - 3 * lambda + R) / 4};
}

Moduli from_poisson_and_lambda(double nu, double lambda) {
  if (nu == 0 || lambda / nu <= 0)
    refuse("lame_lambda", lambda, fmt::format("not zero, and with poisson_ratio = {} of the same sign", nu));
  return {lambda, lambda * (1 - 2 * nu) / (2 * nu)};
}

}  // namespace

Moduli elastic_constants(const MaterialInput& input) {
  constexpr std::string_view names[] = {"youngs_modulus", "poisson_ratio", "shear_modulus", "bulk_modulus", "lame_lambda"};
  double value[5] = {};
  bool has[5] = {};
  int given = 0;
  for (int i = 0; i < 5; ++i)
    if ((has[i] = input.has(names[i]))) {
      value[i] = input.value(names[i]);
      ++given;
      if (!std::isfinite(value[i])) refuse(names[i], value[i], "a finite value");
    }
  if (given != 2)
    throw std::domain_error(
        fmt::format("found {} elastic constants; allowed: exactly two of youngs_modulus, poisson_ratio, shear_modulus, "
                    "bulk_modulus, lame_lambda",
                    given));
  const auto [E, nu, mu, bulk, lambda] = value;
  if (has[0]) positive(names[0], E);
  if (has[1] && !(nu > -1 && nu < 0.5)) refuse(names[1], nu, "a value > -1 and < 0.5");
  if (has[1] && 1 - 2 * nu < smallest_difference)
    refuse(names[1], nu, fmt::format("a value below 0.5 by more than {}: closer to it, rounding decides the bulk modulus; give the bulk modulus itself", smallest_difference / 2));
  if (has[0] && has[2] && E != 3 * mu && std::abs(3 * mu - E) < smallest_difference * mu)
    refuse(names[0], E, fmt::format("a value that differs from three times the shear modulus by more than {} of it: closer, rounding decides the bulk modulus", smallest_difference));
  if (has[2]) positive(names[2], mu);
  if (has[3]) positive(names[3], bulk);
  if (has[4] && std::abs(lambda) > most) refuse(names[4], lambda, fmt::format("a magnitude of at most {}", most));

  Moduli m;
  if (has[0] && has[1])
    m = {E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))};
  else if (has[0] && has[2])
    m = from_young_and_shear(E, mu);
  else if (has[0] && has[3])
    m = from_shear_and_bulk(3 * bulk * E / (9 * bulk - E), bulk);
  else if (has[0])
    m = from_young_and_lambda(E, lambda);
  else if (has[1] && has[2])
    m = {2 * mu * nu / (1 - 2 * nu), mu};
  else if (has[1] && has[3])
    m = {3 * bulk * nu / (1 + nu), 3 * bulk * (1 - 2 * nu) / (2 * (1 + nu))};
  else if (has[1])
    m = from_poisson_and_lambda(nu, lambda);
  else if (has[2] && has[3])
    m = from_shear_and_bulk(mu, bulk);
  else if (has[2])
    m = {lambda, mu};
  else
    m = {lambda, 1.5 * (bulk - lambda)};

  if (!(m.mu > 0) || !std::isfinite(m.mu)) refuse("shear_modulus", m.mu, "a finite value > 0 from the two constants given");
  if (!(m.bulk() > 0) || !std::isfinite(m.bulk()))
    refuse("bulk_modulus", m.bulk(), "a finite value > 0 from the two constants given");
  return m;
}

void require_positive(std::string_view name, double value, std::string_view meaning) {
  if (value > 0 && std::isfinite(value)) return;
  refuse(name, value, meaning.empty() ? "a finite value > 0" : fmt::format("a finite value > 0 ({})", meaning));
}

}  // namespace perikit
