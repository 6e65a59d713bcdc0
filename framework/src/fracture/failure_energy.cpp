#include "fracture/failure_energy.hpp"

namespace perikit {

const char* creates_energy(const Formulation& f, bool stabilized, int dimension) {
  const bool by_bond = f.weighted && f.parts(dimension) == 0;
  return f.point && !stabilized                              ? "one gradient per point without a stabilization"
         : (f.point || f.bond) && f.order > 1               ? "point gradients of order 2 or more, whose moments degenerate as bonds fail"
         : f.bond && f.far_share == 0 && !f.g_from_xi_only ? "bond gradients that rest on the gradient of one end alone, and on its shape tensor"
         : by_bond && f.selective()                        ? "a selective map over weighted gradients of bonds"
         : f.weighted && !by_bond                          ? "gradients of parts of families"
                                                           : nullptr;
}

}  // namespace perikit
