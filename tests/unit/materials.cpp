#include <doctest/doctest.h>

#include "materials/hencky/law.hpp"
#include "materials/linear_elastic/law.hpp"
#include "materials/mooney_rivlin/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/contract/material_contract.hpp"

using namespace perikit;
using contract::check_material;
using contract::Evaluation;
using contract::MaterialOptions;

namespace {

/// (lambda, mu) for mu = 1 and Poisson's ratio nu.
std::vector<double> lame(double nu) { return {2 * nu / (1 - 2 * nu), 1.0}; }

}  // namespace

TEST_CASE("contract: linear_elastic") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<LinearElastic>(), lame(nu), {.law = "linear_elastic", .least_free = 0.2, .most_free = 5});
}

TEST_CASE("contract: saint_venant_kirchhoff") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<SaintVenantKirchhoff>(), lame(nu), {.law = "saint_venant_kirchhoff"});
}

TEST_CASE("contract: neo_hookean") {
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic})
    for (const double kappa : {1.7, 20.0, 1e4})
      check_material(LawMaterial(NeoHookean{form}), {1.0, kappa}, {.law = "neo_hookean", .least_free = 0.4, .most_free = 4});
}

TEST_CASE("contract: mooney_rivlin") {
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic})
    for (const double kappa : {1.7, 20.0, 1e4})
      check_material(LawMaterial(MooneyRivlin{form}), {0.3, 0.2, kappa}, {.law = "mooney_rivlin", .least_free = 0.4, .most_free = 4});
}

TEST_CASE("contract: hencky") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<Hencky>(), lame(nu), {.law = "hencky", .least_free = 0.2, .most_free = 5});
}
