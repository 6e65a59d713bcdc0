#pragma once
#include "perikit/core/field.hpp"

namespace perikit {

/// What is sampled; each comes with those before it.
enum class Sampling { nothing, energy, tensors, virial };

/// Averages of evaluation-point quantities at points, weighted with W_q over the q that each point owns. Component-major over
/// the body's stride; tensors with the components of the space (cauchy: 9, row-major).
struct PointSamples {
  Field strain_energy_density;   ///< sum W psi / V [J/m^3]
  Field H;                       ///< F - I [-]; H33 included in plane and line spaces
  Field P;                       ///< [Pa]; of pair laws the virial per reference volume
  Field cauchy;                  ///< [Pa]
  Field von_mises;               ///< [Pa]
  Sampling asked = Sampling::tensors;   ///< energy: nothing but the density; virial: P of pair laws, too
};

}  // namespace perikit
