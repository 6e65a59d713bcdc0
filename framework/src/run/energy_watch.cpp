/// Whether the energies of a run add up: the sign of a time step that is too long, and of forces that are not those of the
/// energy.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/warnings.hpp"
#include "perikit/problem/motion.hpp"
#include "run/simulation.hpp"

namespace perikit {

namespace {

constexpr double warned_share = 0.1;
/// Of quasi-static runs, whose work is that of trapezoids from one equilibrium to the next: a rubber sheet that is stretched to twice its
/// length in one step is off by 0.2, in four steps by 0.02.
constexpr double warned_share_of_work = 0.25;
/// Velocity Verlet keeps u^2 w^2 (1 - (w dt/2)^2) + v^2 of a mode of frequency w, not its energy: with steps of the share s of
/// the stable one, the imbalance of a body that moves in its highest mode alone comes and goes up to s^2 of its largest energy.
/// 0.95 is beyond that for every s below 0.97; an unstable run, whose energy comes from nowhere, comes to 1.
constexpr double lost_share = 0.95;

/// The kinetic energy that rounding of the displacements gives to the body at each step [J]: a body that is at rest, but far from
/// where it was, has no other.
double rounding_energy(BodyProblem& problem, double time_step) {
  double largest = 0;
  ExactSum mass;
  const ConstFieldView u = problem.state().displacement();
  for (std::size_t k = 0; k < u.size(); ++k) largest = std::max(largest, std::abs(u.data[k]));
  for (const double m : problem.masses().by_point()) mass.add(m);
  const double speed = 16 * std::numeric_limits<double>::epsilon() * communicator().largest(largest) / time_step;
  return 0.5 * total_over_ranks(mass) * speed * speed;
}

/// The work that rounding of the displacements does in a body that is held far from where it was, and has no other: each point is
/// off by a share of the largest displacement, and its springs, of a stiffness (lambda + 2 mu) V/dx^2, act over that displacement.
double rounding_work(BodyProblem& problem) {
  double largest = 0;
  ExactSum stiffness;
  const Points& points = problem.points();
  const ConstFieldView u = problem.state().displacement();
  for (std::size_t k = 0; k < u.size(); ++k) largest = std::max(largest, std::abs(u.data[k]));
  for (const std::int32_t point : points.owned()) {
    const auto p = static_cast<std::size_t>(point);
    const Moduli moduli = problem.laws().moduli(p);
    stiffness.add((moduli.lambda + 2 * moduli.mu) * points.volume(p) / (points.spacing() * points.spacing()));
  }
  const double motion = communicator().largest(largest);
  return 16 * std::numeric_limits<double>::epsilon() * total_over_ranks(stiffness) * motion * motion;
}

/// Energies below have lost digits, or terms of their sums have, and are not judged [J].
constexpr double smallest_energy = std::numeric_limits<double>::min() / (std::numeric_limits<double>::epsilon() * std::numeric_limits<double>::epsilon());

}  // namespace

/// Kinetic energy and work are those of velocity Verlet: with the total forces F(n) and the norm |F|^2 = sum of (dt F/2)^2/(2 m) over the free
/// components, m v^2/2 - |F|^2 is the product of the velocities of two half steps, whose change is the work by the trapezoidal rule. So energies of a
/// linear body are apart by |F(n)|^2 - |F(0)|^2 exactly. Of that the internal forces have at most the share (w dt/2)^2 of the strain energy; the loads
/// have the energy returned here, which near rest is all that there is: a load that grows from 0 has done no work after its first step.
double energy_of_load_kick(BodyProblem& problem, double time_step) {
  if (!problem.loads().any()) return 0;
  const std::span<const double> masses = problem.masses().by_point();
  const ConstFieldView load = problem.state().external_force(), free = problem.constraints().free();
  ExactSum sum;
  for (int c = 0; c < load.components; ++c)
    sum.add(exact_sum(masses.size(), [m = masses.data(), f = load.component(c), mask = free.component(c), time_step](std::size_t p) {
      if (m[p] <= 0 || mask[p] == 0) return 0.0;
      const double v = 0.5 * time_step * f[p] / m[p];
      return 0.5 * m[p] * v * v;
    }));
  return total_over_ranks(sum);
}

/// Both parts of the total force may point the same way: by the triangle inequality for |F|, what `kick` leaves of an imbalance is the square of
/// what its root has beyond that of `kick`.
double EnergyBalance::add(const Energies& e, double kick) noexcept {
  const double apart = std::abs(e.strain + e.kinetic + e.dissipated - e.external_work - initial);
  const double beyond = std::max(std::sqrt(apart) - std::sqrt(kick), 0.0), imbalance = kick > 0 ? beyond * beyond : apart;
  largest = std::max(
      {largest, std::abs(e.strain), std::abs(e.kinetic), std::abs(e.external_work), std::abs(e.dissipated), std::abs(initial)});
  off = std::max(off, imbalance);
  return imbalance;
}

void RunRecorder::watch_energies(const StepReport& report, bool recorded) {
  BodyProblem& problem = simulation_.problem();
  Energies& e = problem.state().energies;
  if (simulation_.dynamic()) e.kinetic = kinetic_energy(problem, problem.state().velocity());
  if (!recorded) return;
  EnergyBalance& balance = done_.energies;
  if (report.step == 0) balance.initial = e.strain + e.kinetic;
  const double off = balance.add(e, simulation_.dynamic() ? energy_of_load_kick(problem, report.time_step) : 0.0);
  if (!simulation_.dynamic() || !problem.terms().conservative() || off <= lost_share * balance.largest) return;
  if (balance.largest <= smallest_energy || off <= rounding_energy(problem, report.time_step)) return;
  if (!std::isfinite(off))
    throw RunError(fmt::format("step {}, time {:.6g} s: the energies are beyond what a number can hold: strain {:.3g} J, kinetic {:.3g} J, work {:.3g} J", report.step,
                               report.time, e.strain, e.kinetic, e.external_work));
  throw RunError(
      fmt::format("step {}, time {:.6g} s: the energies do not add up any more: strain {:.3g} J, kinetic {:.3g} J and dissipated "
                  "{:.3g} J, from {:.3g} J "
                  "at the start and {:.3g} J of work; off by {:.2g} of the largest, more than {}; a shorter time step helps "
                  "where the body has become "
                  "stiffer than at the start",
                  report.step, report.time, e.strain, e.kinetic, e.dissipated, balance.initial, e.external_work,
                  off / balance.largest, lost_share));
}

std::string RunRecorder::energy_warning() const {
  const EnergyBalance& balance = done_.energies;
  BodyProblem& problem = simulation_.problem();
  if (!problem.terms().conservative() || balance.share() <= warned_share) return {};
  if (simulation_.quasi_static() && balance.share() > warned_share_of_work && balance.off > rounding_work(problem)) {
    return named("energy", fmt::format(
        "warning: strain energy and the work of loads and boundaries were apart by up to {:.3g} J, {:.2g} of the largest energy of the "
        "run (more than {}): load steps are too few to follow the path, the body has jumped from one equilibrium to another, or a part "
        "of it is hardly held",
        balance.off, balance.share(), warned_share_of_work));
  }
  const double steps = static_cast<double>(std::max<std::int64_t>(1, problem.state().step));
  if (!simulation_.dynamic() || balance.off <= rounding_energy(problem, problem.state().time / steps)) return {};
  return named("energy", fmt::format(
      "warning: the energies were off by up to {:.3g} J, {:.2g} of the largest energy of the run (more than {}): steps that are "
      "shorter resolve "
      "the motion better",
      balance.off, balance.share(), warned_share));
}

}  // namespace perikit
