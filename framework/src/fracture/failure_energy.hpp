#pragma once
/// Whether bonds that fail create energy under a formulation (framework/docs/fracture.md, "Every kinematics and kernel").

#include "model/formulation.hpp"

namespace perikit {

/// What of the formulation does; null where updates of bonds raise the energy by a few per cent of what they take at most.
const char* creates_energy(const Formulation& formulation, bool stabilized, int dimension);

}  // namespace perikit
