#include "perikit/sdk/equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"

namespace perikit {

Equilibrium::Equilibrium(Problem& problem, double tolerance)
    : problem_(problem), tolerance_(tolerance), u_(problem.make_field()), scratch_(problem.make_field()),
      free_(problem.constraints().free()), external_(problem.loads().any() ? problem.state().external_force() : FieldView{}) {}

void Equilibrium::begin(double t, ConstFieldView u, double time_step) {
  t_ = t;
  time_step_ = time_step;
  step_factor_ = 1;
  copy(u, u_);
  if (external_.data && !problem_.loads().follow()) problem_.loads().evaluate(t, external_);
  Field noise = problem_.make_field();
  fill_with_noise(free_, 1, problem_.points().places(), noise);
  const double size = norm(noise);
  // Where the start itself is inadmissible there is nothing to estimate; the first residual says so.
  if (size > 0 && problem_.tangent_action(at(u), noise, scratch_).ok()) stiffness_ = norm(scratch_) / size;
}

double Equilibrium::missing(ConstFieldView u, FieldView w) {
  fill(0.0, w);
  if (problem_.constraints().any()) problem_.constraints().prescribe_displacement(t_, w);
  for (const std::int64_t dof : problem_.constraints().dofs()) w.data[dof] -= u.data[dof];
  return largest_magnitude(w);  // of all ranks, some of which may hold no point that is prescribed
}

bool Equilibrium::goes_on() {
  if (step_factor_ < 1) return false;   // failure_ says why
  if (!observer_ || !observer_->interrupted()) return true;
  stopped_ = true;
  failure_ = "the run was stopped";
  return false;
}

bool Equilibrium::residual(ConstFieldView u, FieldView r, double* energy) {
  if (!goes_on()) return false;
  const FieldView internal = problem_.state().internal_force();
  const EvaluationStatus status = problem_.evaluate_forces(at(u), internal, energy);
  if (!status.ok()) {
    failure_ = status.description;
    step_factor_ = status.step_factor;
    return false;
  }
  copy(internal, r);
  if (problem_.loads().follow() && !problem_.external_forces(at(u), external_).ok()) {
    failure_ = "the pressure met an inadmissible deformation";
    return false;
  }
  if (external_.data) combine(1, r, 1, external_, r);
  // In a unit that squares can be taken in, whatever the size of forces.
  double largest = external_.data ? largest_magnitude(external_) : 0.0;
  for (const std::int64_t dof : problem_.constraints().dofs()) largest = std::max(largest, std::abs(r.data[dof]));
  const double unit = power_of_two(communicator().largest(largest));
  double squares = external_.data ? total_over_ranks(exact_sum(external_.size(), [&](std::size_t k) { return (external_.data[k] / unit) * (external_.data[k] / unit); })) : 0.0;
  ExactSum reactions;
  for (const std::int64_t dof : problem_.constraints().dofs()) {
    const double outer = (external_.data ? external_.data[dof] : 0.0) / unit, reaction = -r.data[dof] / unit;
    reactions.add(reaction * reaction - outer * outer);  // loads on prescribed components go into the reactions
  }
  squares += total_over_ranks(reactions);
  mask(free_, r);
  norm_ = norm(r);
  reference_ = unit * std::sqrt(std::max(squares, 0.0));
  // What displacements are rounded to: their last digit, or where they have none the smallest number.
  const double rounding = std::numeric_limits<double>::epsilon() * norm(u) + std::numeric_limits<double>::denorm_min() * std::sqrt(static_cast<double>(u.size()));
  reference_ = std::max(reference_, 4 * stiffness_ * rounding / tolerance_);
  if (std::isfinite(norm_) && std::isfinite(reference_)) return true;
  failure_ = "the forces are not finite";
  return false;
}

bool Equilibrium::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  if (!goes_on()) return false;
  if (observer_ && ++actions_ % 8 == 0) observer_->working(fmt::format("t = {:.4g}: {}{}, {} tangent actions", t_, stage_, last_note_, actions_));
  EvaluationStatus status = problem_.tangent_action(at(u), w, Kw);
  if (status.ok() && problem_.loads().follow()) status = problem_.add_load_stiffness(at(u), w, Kw);
  if (!status.ok()) {
    failure_ = status.description.empty() ? "the tangent met an inadmissible deformation" : status.description;
    return false;
  }
  mask(free_, Kw);
  return true;
}

void Equilibrium::note(std::string_view line) {
  notes_ += line;
  notes_ += '\n';
  if (!observer_) return;
  actions_ = 0;
  last_note_ = line.substr(std::min(line.find_first_not_of(' '), line.size()));
  observer_->working(fmt::format("t = {:.4g}: {}{}", t_, stage_, last_note_));
  const auto now = std::chrono::steady_clock::now();
  if (now - logged_ < std::chrono::seconds(5)) return;
  logged_ = now;
  std::string lines = take_notes();
  lines.pop_back();   // a log has line ends of its own
  observer_->log(lines);
}

std::string Equilibrium::take_notes() { return std::exchange(notes_, {}); }

}  // namespace perikit
