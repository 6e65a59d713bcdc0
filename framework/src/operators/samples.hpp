#pragma once
#include "perikit/core/field.hpp"

namespace perikit {

/// What is sampled, several of them added by |. The energy density comes with all of them.
enum class Sampling : unsigned { nothing = 0, energy = 1, H = 2, P = 4, cauchy = 8, von_mises = 16, tensors = 31 };
constexpr Sampling operator|(Sampling a, Sampling b) noexcept { return static_cast<Sampling>(static_cast<unsigned>(a) | static_cast<unsigned>(b)); }
/// Whether they have something in common.
constexpr bool any_of(Sampling a, Sampling b) noexcept { return (static_cast<unsigned>(a) & static_cast<unsigned>(b)) != 0; }

/// Averages of evaluation-point quantities at points, weighted with W_q over the q that each point owns. Component-major over
/// the body's stride; tensors with the components of the space (cauchy: 9, row-major). What was not asked for is empty. Of pair laws, which have no
/// evaluation points: the least-squares gradient over the bonds of a point, and the stresses of its ends of these bonds (PairForces).
struct PointSamples {
  Field strain_energy_density;   ///< sum W psi / V [J/m^3]
  Field H;                       ///< F - I [-]; H33 included in plane and line spaces
  Field P;                       ///< [Pa]
  Field cauchy;                  ///< [Pa]
  Field von_mises;               ///< [Pa]
  Sampling asked = Sampling::tensors;
};

}  // namespace perikit
