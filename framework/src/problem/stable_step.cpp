#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "perikit/body/lattice.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/problem/body_problem.hpp"
#include "perikit/sdk/eigenvalue.hpp"

namespace perikit {

double BodyProblem::largest_eigenvalue(ConstFieldView u) {
  const auto masses = mass();
  const ConstFieldView free = free_mask();
  // M^-1/2 K M^-1/2 restricted to the free components.
  Field scale = body_.make_field(dimension());
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double m = masses[k % stride()];
    scale.data()[k] = m > 0 ? free.data[k] / std::sqrt(m) : 0.0;
  }
  const bool warm = eigenvector_.size() > 0;
  if (!warm) eigenvector_ = body_.make_field(dimension());
  return perikit::largest_eigenvalue(*this, u, scale, eigenvector_, warm);
}

double BodyProblem::bond_based_time_step() const {
  // P 3.58 for a whole family: dt = sqrt(2 rho / sum_j V_j C / |xi|), on a lattice of the mean spacing.
  const int d = dimension();
  const double delta = body_.horizon(), dx = body_.spacing(), section = body_.section();
  const double reach = 2 * std::ceil(delta / dx) * dx;
  const Lattice lattice = make_lattice(d, dx, {}, {reach + dx, reach + dx, reach + dx}, delta);
  double sum = 0;
  for (const auto& offset : family_offsets(lattice, delta)) {
    sum += std::pow(dx, d) * section / (dx * std::sqrt(double(offset[0]) * offset[0] + double(offset[1]) * offset[1] + double(offset[2]) * offset[2]));
  }
  double least = 0;
  for (const std::int32_t index : body_.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const Moduli moduli = laws_->moduli(p);
    const double pi = std::numbers::pi, nu = moduli.poisson(), K = moduli.bulk();
    const double plane = body_.space() == Space::plane_stress ? moduli.youngs() / (2 * (1 - nu)) : K + moduli.mu / 3;
    const double C = d == 3 ? 18 * K / (pi * std::pow(delta, 4))
                   : d == 2 ? 12 * plane / (pi * section * std::pow(delta, 3)) : 2 * moduli.youngs() / (section * delta * delta);
    const double dt = std::sqrt(2 * laws_->density(p) / (C * sum));
    least = least > 0 ? std::min(least, dt) : dt;
    if (laws_->single() && laws_->record_of(p).densities.empty()) break;
  }
  return -communicator().largest(-least);
}

}  // namespace perikit
