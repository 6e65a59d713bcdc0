/// Whether the energies of a run add up: the sign of a time step that is too long, and of forces that are not those of the
/// energy.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/communicator.hpp"
#include "perikit/problem/motion.hpp"
#include "perikit/run/simulation.hpp"

namespace perikit {

namespace {

constexpr double warned_share = 0.1;
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

}  // namespace

double EnergyBalance::add(const Energies& e) noexcept {
  const double imbalance = std::abs(e.strain + e.kinetic + e.dissipated - e.external_work - initial);
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
  const double off = balance.add(e);
  if (!simulation_.dynamic() || !problem.terms().conservative() || !(off > lost_share * balance.largest)) return;
  if (off <= rounding_energy(problem, report.time_step)) return;
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
  if (!simulation_.dynamic() || !problem.terms().conservative() || balance.share() <= warned_share) return {};
  if (balance.off <=
      rounding_energy(problem, problem.state().time / static_cast<double>(std::max<std::int64_t>(1, problem.state().step))))
    return {};
  return fmt::format(
      "warning: the energies were off by up to {:.3g} J, {:.2g} of the largest energy of the run (more than {}): steps that are "
      "shorter resolve "
      "the motion better",
      balance.off, balance.share(), warned_share);
}

}  // namespace perikit
