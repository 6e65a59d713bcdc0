#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "families/gradual_failure.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

namespace {

/// <xi> = int omega xi^d / int omega xi^(d-1) over (0, delta), by the midpoint rule.
double mean_bond_length(const InfluenceFunction& influence, int dimension, double horizon) {
  constexpr std::size_t steps = 20000;
  std::vector<double> r(steps), omega(steps);
  for (std::size_t k = 0; k < steps; ++k) r[k] = (static_cast<double>(k) + 0.5) / steps;
  influence.evaluate(r, omega);
  double above = 0, below = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double weight = omega[k] * std::pow(r[k], dimension - 1);
    above += weight * r[k];
    below += weight;
  }
  return above / below * horizon;
}

}  // namespace

void BodyProblem::read_damage() {
  if (!damage_law_) return;
  const auto refuse = [&](const std::string& found, const std::string& allowed) {
    throw InputError(scene_.damage->values.position(""), "damage", fmt::format("found with {}; allowed: {}", found, allowed));
  };
  if (partition_) refuse("a body on several ranks", "one rank");
  if (formulation_.force_state == ForceState::local) refuse("kinematics.force_state = \"local\"", "\"variational\"");
  if (laws_->history()) refuse("a law whose stress depends on the path", "hyperelastic laws");
  if (scene_.stabilization && formulation_.order > 1)
    refuse("kinematics.stabilization over point gradients of higher order", "order 1, or kinematics without a stabilization");
  if (formulation_.bond && formulation_.order > 1) {
    refuse(
        fmt::format("kinematics \"{}\" of order {}, whose point gradients are made once", scene_.kinematics->type, formulation_.order),
        "order 1");
  }
  damage_ = std::make_unique<BodyDamage>();
  damage_->law = damage_law_;
  damage_->onset = body_.make_field(1);
  damage_->failure = body_.make_field(1);
  GradualFailure* const gradual = gradual_failure(damage_law_);
  Field crack_speed = gradual ? body_.make_field(1) : Field();
  DamagePoint at{{body_.space(), body_.section(), body_.horizon(), {}}, mean_bond_length(*influence_, dimension(), body_.horizon())};
  const bool uniform = laws_->same(static_cast<std::size_t>(body_.internal().front()), static_cast<std::size_t>(body_.internal().back())) && laws_->records().size() == 1;
  StretchLimits limits;
  bool equal = true;
  for (std::size_t k = 0; k < body_.internal().size(); ++k) {
    const auto p = static_cast<std::size_t>(body_.internal()[k]);
    if (k == 0 || !uniform) {
      at.moduli = laws_->moduli(p);
      try {
        limits = damage_law_->limits(at);
      } catch (const std::domain_error& error) {
        throw InputError(scene_.damage->values.position(""), "damage", error.what());
      }
    }
    damage_->onset.data()[p] = limits.onset;
    damage_->failure.data()[p] = limits.failure;
    if (gradual) {
      // Rayleigh waves, by Viktorov's approximation. Whether there is a density is asked with the masses.
      const double nu = at.moduli.poisson(), density = laws_->density(p);
      crack_speed.data()[p] = density > 0 ? std::sqrt(at.moduli.mu / density) * (0.862 + 1.14 * nu) / (1 + nu) : 0.0;
    }
    equal = equal && limits.onset == limits.failure;
  }
  for (const std::string& set : scene_.no_fail)
    for (const std::int32_t p : body_.set(set)) {
      damage_->onset.data()[p] = damage_->failure.data()[p] = std::numeric_limits<double>::infinity();
    }
  if (equal) damage_->failure = Field();
  if (gradual) gradual->prepare(body_, std::move(crack_speed));
}

EvaluationStatus BodyProblem::assemble_tangent(ConstFieldView u, BlockMatrix& K) {
  refuse_assembly();
  const EvaluationStatus status = model_->assemble(u, K);
  const std::vector<BondChange> changed = status.ok() ? model_->changed_bonds() : std::vector<BondChange>{};
  if (changed.empty()) return status;
  constexpr double share = 1e-9;
  const auto d = static_cast<std::size_t>(K.dimension);
  const auto diagonal = [&](std::size_t row) {
    const auto begin = K.column.begin() + K.row_first[row], end = K.column.begin() + K.row_first[row + 1];
    return K.values.data() +
           static_cast<std::size_t>(std::lower_bound(begin, end, static_cast<std::int32_t>(row)) - K.column.begin()) * d * d;
  };
  double sum = 0;
  for (std::size_t row = 0; row < K.rows(); ++row)
    for (std::size_t c = 0; c < d; ++c) sum += std::abs(diagonal(row)[c * d + c]);
  const double held = share * sum / static_cast<double>(K.rows() * d);
  std::vector<std::uint8_t> ends(stride(), 0);
  for (const BondChange& b : changed) ends[static_cast<std::size_t>(b.point)] = ends[static_cast<std::size_t>(b.far)] = 1;
  for (std::size_t row = 0; row < K.rows(); ++row)
    for (std::size_t c = 0; c < d && ends[static_cast<std::size_t>(K.point[row])]; ++c) diagonal(row)[c * d + c] += held;
  return status;
}

bool BodyProblem::update_bonds(double time_step, ConstFieldView velocity) {
  // Half of the next step of an explicit scheme: its forces are known, and come from the bonds as they were.
  const Motion half_step = [&](FieldView end) {
    const auto masses = mass();
    const ConstFieldView free = free_mask(), external = any_load() ? ConstFieldView(external_force()) : ConstFieldView();
    for (std::size_t k = 0; k < end.size(); ++k) {
      const double m = masses[k % stride()], force = internal_force_.data()[k] + (external.data ? external.data[k] : 0.0);
      const double next = velocity.data[k] + (m > 0 ? free.data[k] * time_step * force / m : 0.0);
      end.data[k] = displacement_.data()[k] + 0.5 * time_step * next;
    }
  };
  if (GradualFailure* const gradual = gradual_failure(damage_law_)) gradual->set_time_step(time_step);
  const BondUpdate update = model_->update_bonds(displacement_, velocity.data ? half_step : Motion());
  energies_.dissipated += update.dissipated;
  energies_.strain -= update.released;
  if (update.dissipated < 0) {
    ++gains_;
    gained_ -= update.dissipated;
  }
  return update.changed > 0;
}

std::string BodyProblem::fracture_summary() const {
  if (!damage_) return {};
  const BondChecks checks = model_->bond_checks();
  std::string text = fmt::format("failed bonds  {}, weakened {}, dissipated {:.6g} J\n", checks.failed, checks.weakened, energies_.dissipated);
  if (checks.groups > 0) {
    text += fmt::format(
        "bond checks   {} of {} groups of eight points in {} updates ({:.2f} %); the others were too far from failing\n",
        checks.checked, checks.groups, checks.updates,
        100.0 * static_cast<double>(checks.checked) / static_cast<double>(checks.groups));
  }
  if (gains_ > 0) {
    const double lost = energies_.dissipated + gained_;
    text += fmt::format("warning       {} updates of bonds raised the strain energy, by {:.6g} J in all; the others took {:.6g} J\n", gains_, gained_, lost);
  }
  return text;
}

}  // namespace perikit
