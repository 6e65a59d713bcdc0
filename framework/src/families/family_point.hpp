#pragma once
#include "perikit/body/body.hpp"
#include "perikit/operators/laws.hpp"
#include "perikit/model/stabilization.hpp"

namespace perikit {

inline FamilyPoint family_point(const Body& body, const Laws& laws, std::size_t p) {
  return {body.space(), body.section(), body.horizon(), laws.moduli(p)};
}

/// intact: sum omega V_j over intact bonds; damage: D_i; volumes: sum V_j over the whole family; inverse: K_i^-1.
inline PenaltyPoint penalty_point(const Body& body, const Laws& laws, std::size_t p, double intact, double damage, double volumes,
                                  const double* inverse) {
  return {family_point(body, laws, p), intact / (1 - damage) / volumes, inverse};
}

}  // namespace perikit
