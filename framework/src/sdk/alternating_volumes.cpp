#include "sdk/alternating_volumes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "perikit/core/block_matrix.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/operators/laws.hpp"
#include "perikit/problem/volumetric_part.hpp"

namespace perikit {

namespace {

// Second derivative of the energy over the shear modulus: true fields of volumes hold less than `noticed` there.
constexpr double nearly_incompressible = 500;
constexpr double ordinary_bulk = 5.0 / 3;  // of the companion, of which only the pattern counts
constexpr double noticed = 0.01;

/// On whatever rank.
bool has_nearly_incompressible(const Problem& problem) {
  const bool here = std::ranges::any_of(problem.points().owned(), [&](std::int32_t index) {
    const Moduli moduli = problem.laws().moduli(static_cast<std::size_t>(index));
    return moduli.mu > 0 && moduli.bulk() >= nearly_incompressible * moduli.mu;
  });
  return communicator().largest(here ? 1.0 : 0.0) > 0;
}

/// By point, of ghosts, too.
Field shared(Problem& problem, ConstFieldView of_owners) {
  Field all = problem.points().make_field(1);
  for (const std::int32_t p : problem.points().owned()) all.data()[p] = of_owners.data[p];
  problem.share(all);
  return all;
}

}  // namespace

double energy_of_alternating_volumes(Problem& problem, ConstFieldView u) {
  const std::unique_ptr<VolumetricPart> volumes = has_nearly_incompressible(problem) ? problem.volumetric_part() : nullptr;
  if (!volumes || !volumes->linearise(u).ok()) return 0;
  Field force = problem.make_field();
  double strain_energy = 0;
  if (!problem.evaluate_forces({u, problem.state().time}, force, &strain_energy).ok() || !(strain_energy > 0)) return 0;
  BlockMatrix neighbours;
  problem.assemble_companion(u, neighbours, ordinary_bulk);
  const Field logarithms = shared(problem, volumes->logarithms()), stiffnesses = shared(problem, volumes->stiffness());
  const double *logarithm = logarithms.data(), *stiffness = stiffnesses.data();
  ExactSum energy;
  for (std::size_t r = 0; r < neighbours.rows(); ++r) {
    const auto point = static_cast<std::size_t>(neighbours.point[r]);
    if (!problem.points().owns(point)) continue;
    if (stiffness[point] < nearly_incompressible * problem.laws().moduli(point).mu * problem.points().volume(point)) continue;
    double sum = 0;
    int count = 0;
    for (std::int64_t b = neighbours.row_first[r]; b < neighbours.row_first[r + 1]; ++b) {
      const auto other =
          static_cast<std::size_t>(neighbours.point[static_cast<std::size_t>(neighbours.column[static_cast<std::size_t>(b)])]);
      if (other == point || stiffness[other] == 0) continue;  // images have no volume of their own
      sum += logarithm[other];
      ++count;
    }
    if (count == 0) continue;
    const double alternating = logarithm[point] - sum / count;
    energy.add(stiffness[point] * alternating * alternating / 2);
  }
  return total_over_ranks(energy) / strain_energy;
}

std::string warn_of_alternating_volumes(Problem& problem, ConstFieldView u) {
  const double share = energy_of_alternating_volumes(problem, u);
  if (share < noticed) return {};
  return fmt::format(
      "{:.2g} % of the strain energy is in volumes of points that alternate between neighbours: so many volumes cannot be kept "
      "by so few displacements, the body is too stiff and the pressures of points are wrong. More points help, or a smaller bulk "
      "modulus",
      100 * share);
}

}  // namespace perikit
