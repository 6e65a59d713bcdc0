#include "perikit/sdk/stable_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/warnings.hpp"
#include "perikit/model/family_point.hpp"

namespace perikit {

namespace {

/// The diagonal of M^-1/2, restricted to the free components.
Field root_of_masses(Problem& problem) {
  const std::span<const double> masses = problem.masses().by_point();
  const ConstFieldView free = problem.constraints().free();
  Field scale = problem.make_field();
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double m = masses[k % free.stride];
    scale.data()[k] = m > 0 ? free.data[k] / std::sqrt(m) : 0.0;
  }
  return scale;
}

}  // namespace

EigenvalueBounds eigenvalue_bounds(Problem& problem, ConstFieldView u, double enough, const GoesOn& goes_on) {
  const FieldView eigenvector = problem.state().declare("eigenvector");
  return eigenvalue_bounds(problem, u, root_of_masses(problem), eigenvector, norm(eigenvector) > 0, enough, goes_on);
}

double largest_eigenvalue(Problem& problem, ConstFieldView u) { return eigenvalue_bounds(problem, u, 0).bound; }

double largest_eigenvalue(Problem& problem, DamagedPart& part, ConstFieldView u, double enough) {
  return largest_eigenvalue(problem, part, u, root_of_masses(problem), enough);
}

void allow_unstable_parameter(ParameterTable& table) {
  table.boolean("allow_unstable", "Take a time_step that is longer than the longest stable one; it is refused otherwise.")
      .by_default("false");
}

void check_time_step(Problem& problem, const ParameterValues& values, Observer* observer) {
  const bool allowed = values.boolean("allow_unstable");
  if (!values.has("time_step")) {
    if (allowed)
      throw values.error("allow_unstable",
                         "found without time_step, whose length is then stable anyway; allowed: with time_step");
    return;
  }
  const double step = values.number("time_step");
  const double eigenvalue = largest_eigenvalue(problem, problem.state().displacement());
  if (!(eigenvalue > 0) || step <= 2 / std::sqrt(eigenvalue)) return;
  const std::string found =
      fmt::format("{} s, but the longest stable step at the start is {:.4g} s", step, 2 / std::sqrt(eigenvalue));
  if (!allowed) {
    throw values.error(
        "time_step",
        fmt::format("found {}; allowed: at most that, no time_step, which takes 0.9 of it, or allow_unstable = true", found));
  }
  if (observer) observer->log(named("time_step", fmt::format("warning: {}.time_step is {}: allowed by allow_unstable", values.path(), found)));
}

double bond_based_time_step(const Body& body, const Laws& laws) {
  const int d = body.dimension();
  const double delta = body.horizon(), dx = body.spacing();
  const double reach = 2 * std::ceil(delta / dx) * dx;
  const Lattice lattice = make_lattice(d, dx, {}, {reach + dx, reach + dx, reach + dx}, delta);
  double sum = 0;  // of V_j/|xi|
  for (const auto& offset : family_offsets(lattice, delta)) {
    sum += std::pow(dx, d) * body.section() /
           (dx * std::sqrt(double(offset[0]) * offset[0] + double(offset[1]) * offset[1] + double(offset[2]) * offset[2]));
  }
  double least = 0;
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const FamilyPoint point{body.space(), body.section(), delta, laws.moduli(p)};
    const double dt = std::sqrt(2 * laws.density(p) / (point.micromodulus() * sum));
    least = least > 0 ? std::min(least, dt) : dt;
    if (laws.single() && laws.record_of(p).densities.empty()) break;
  }
  return -communicator().largest(-least);
}

}  // namespace perikit
