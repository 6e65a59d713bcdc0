#pragma once
/// Any two of the five elastic constants of an isotropic solid determine the other three.

#include "perikit/model/material.hpp"

namespace perikit {

/// Lame constants from the two of youngs_modulus, poisson_ratio, shear_modulus, bulk_modulus, lame_lambda that `input` has.
/// Throws std::domain_error naming what is wrong: not exactly two given, a modulus that must be positive and is not,
/// poisson_ratio outside (-1, 1/2), not finite.
Moduli elastic_constants(const MaterialInput& input);

/// Throws std::domain_error with the name and the meaning of a constant that is not positive and finite.
void require_positive(std::string_view name, double value, std::string_view meaning = {});

}  // namespace perikit
