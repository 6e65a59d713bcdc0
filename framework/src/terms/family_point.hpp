#pragma once
#include "families/families.hpp"
#include "perikit/model/stabilization.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

inline FamilyPoint family_point(const Body& body, const Laws& laws, std::size_t p) {
  return {body.space(), body.section(), body.horizon(), laws.moduli(p)};
}

/// intact: sum omega V_j over intact bonds; inverse: K_i^-1.
inline PenaltyPoint penalty_point(const Families& families, const Laws& laws, std::size_t p, double intact, const double* inverse) {
  return {family_point(families.body(), laws, p), intact / (1 - families.damage(p)) / families.normaliser(p, BondWeight::volume), inverse};
}

}  // namespace perikit
