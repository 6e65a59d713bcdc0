// Formulas that ask for memory, which no device can give.
#include <vector>

#include "families/stencils.hpp"

double residual(const double* H, const double* u, const double* xi, int count) {
  std::vector<double> z(static_cast<std::size_t>(count));
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    const double bond[1] = {xi[k]};
    z[static_cast<std::size_t>(k)] = perikit::bond_residual<1>(u[k], H, bond);
  }
  for (const double value : z) sum += value;
  return sum;
}
