#pragma once
#include "perikit/core/field.hpp"

namespace perikit {

/// Averages of evaluation-point quantities at points, weighted with W_q over the q that each point owns. Component-major over
/// the body's stride; tensors with the components of the space (cauchy: 9, row-major).
struct PointSamples {
  Field strain_energy_density;   ///< sum W psi / V [J/m^3]
  Field H;                       ///< F - I [-]; H33 included in plane and line spaces
  Field P;                       ///< [Pa]; of pair laws the virial per reference volume, where `virial` asks for it
  Field cauchy;                  ///< [Pa]
  Field von_mises;               ///< [Pa]
  bool virial = false;           ///< asked for: P of pair laws
};

}  // namespace perikit
