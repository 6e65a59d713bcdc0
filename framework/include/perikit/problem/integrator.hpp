#pragma once
/// Integrators run a Problem and report to an Observer.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/core/field.hpp"
#include "perikit/model/material.hpp"

namespace perikit {

/// Totals over the body [J]; external_work is what boundaries and loads have put in.
struct Energies {
  double strain = 0, kinetic = 0, external_work = 0, dissipated = 0;
};

/// What an integrator tells after every finished step.
struct StepReport {
  std::int64_t step = 0;           ///< 0 for the initial state
  double time = 0;                 ///< [s], or the load parameter in [0, 1]
  double time_step = 0;
  int iterations = 0;              ///< of the nonlinear solver, 0 for explicit steps
  double residual = 0;             ///< relative, 0 for explicit steps
  double end_time = 0;
  std::int64_t steps_expected = 0; ///< 0: unknown
};

class Observer {
 public:
  virtual ~Observer() = default;
  /// Asked once before every step_done: true when the state after this step will be sampled, so that energies, work and velocity
  /// must be up to date when step_done is called.
  virtual bool wants_sample(std::int64_t step, double time) = 0;
  /// Called after every step (and once with step 0). May write frames and history.
  virtual void step_done(const StepReport& report) = 0;
  /// A line for run.log.
  virtual void log(std::string_view message) = 0;
  /// True when the run should end after this step.
  virtual bool cancelled() const noexcept { return false; }
};

/// A body with its model, loads, constraints and state, as an integrator sees it. All point fields have `dimension` components,
/// `stride` points per component; dead points (padding) hold zero and stay zero.
class Problem {
 public:
  virtual ~Problem() = default;

  virtual int dimension() const noexcept = 0;
  virtual std::size_t stride() const noexcept = 0;
  /// Real points.
  virtual std::size_t points() const noexcept = 0;
  /// Typical distance of neighbouring points [m].
  virtual double spacing() const noexcept = 0;
  /// A new zero field with the margins that the kernels need.
  virtual Field make_field(int components) const = 0;

  // State. Every run variable is one of these declared fields; extra ones are added by `declare`.
  virtual FieldView displacement() noexcept = 0;
  virtual FieldView velocity() noexcept = 0;        ///< allocated on first use; at full steps where a sample was asked for
  virtual FieldView internal_force() noexcept = 0;  ///< [N] on each point, of the last evaluation
  virtual FieldView external_force() noexcept = 0;  ///< [N]; allocated on first use
  /// A further run variable of the integrator that snapshots must hold.
  virtual FieldView declare(const std::string& name, int components) = 0;
  /// Further numbers of the integrator that snapshots must hold, zero at first.
  virtual std::span<double> declare_numbers(const std::string& name, std::size_t count) = 0;
  virtual double& time() noexcept = 0;
  virtual std::int64_t& step() noexcept = 0;
  virtual Energies& energies() noexcept = 0;
  /// Everything that a run continues from, as bytes; restore is bitwise.
  virtual std::vector<std::byte> snapshot() const = 0;
  virtual void restore(std::span<const std::byte> bytes) = 0;

  /// Mass of each point [kg], 0 at dead points, one component. Throws InputError where a density is missing.
  virtual std::span<const double> mass() = 0;
  /// The mass that all points share, or 0 where they differ; lets a kernel skip reading them.
  virtual double uniform_mass() = 0;

  // Forces. `u` must come from make_field.
  /// internal_force <- f(u) [N]; strain energy -> *energy where wanted. time_step > 0 [s]: u ends a step of this length, and laws
  /// with history put theirs aside for advance_history; 0: nothing is kept.
  virtual EvaluationStatus evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step = 0) = 0;
  /// Kw <- dF/du . w at u, exact; K = -d(force)/du, so that Kw is the stiffness times w [N].
  virtual EvaluationStatus tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) = 0;
  /// K <- -d(force)/du at u [N/m] over all live points, constrained ones too. The pattern is made where K has none; one that K
  /// has must come from this problem. Values are overwritten; undefined after a failure. Points at bonds that have failed are
  /// held by 1e-9 of the mean stiffness of a point: pieces that nothing else holds then stay where they are, and K is not
  /// singular.
  virtual EvaluationStatus assemble_tangent(ConstFieldView u, BlockMatrix& K) = 0;
  /// What assemble_tangent would take, at little cost: for refusing before the memory runs out.
  virtual AssembledSize assembled_size() = 0;
  /// K <- the stiffness at u of springs between nearest neighbours with the moduli of the body [N/m]: symmetric, cheap, spectrally close to
  /// the tangent. For preconditioners. Pattern and values as with assemble_tangent.
  virtual void assemble_companion(ConstFieldView u, BlockMatrix& K) = 0;
  /// The motions of the body at u as a whole, d (d + 1)/2 fields of about the same size: translations, then rotations about its middle.
  virtual std::vector<Field> rigid_motions(ConstFieldView u) = 0;
  /// Loads at time (or load parameter) t [N].
  virtual void evaluate_loads(double t, FieldView force) = 0;
  virtual bool any_load() const noexcept = 0;
  virtual bool loads_depend_on_time() const noexcept = 0;
  /// After a finished step: the history that its last evaluate_forces put aside, damage. Returns true when bonds changed.
  /// velocity: of explicit schemes, of the last half step. Their forces of this step come from the bonds as they were, so that
  /// bonds that fail now act for another half step, and what they dissipate is taken there. Quasi-static runs call it at every
  /// equilibrium: as long as bonds change, the step is not over.
  virtual bool advance_history(double time_step, ConstFieldView velocity = {}) = 0;
  /// With [damage]: the bonds as they are, to return to where a step is given up. Empty without.
  virtual std::vector<std::byte> bonds() const = 0;
  /// Bonds of `bonds`, not empty.
  virtual void restore_bonds(std::span<const std::byte> bonds) = 0;

  // Constraints.
  virtual bool any_constraint() const noexcept = 0;
  /// Prescribed degrees of freedom as c * stride + p, ascending.
  virtual std::span<const std::int64_t> constrained() const noexcept = 0;
  /// 1 where component c of point p is free, 0 where prescribed or dead: mask[c * stride + p].
  virtual ConstFieldView free_mask() const noexcept = 0;
  /// Overwrites prescribed components of v. Prescribed displacements give (U(t_end) - u) / (t_end - t_begin), u the current displacement.
  virtual void prescribe_half_step_velocity(double t_begin, double t_end, FieldView v) = 0;
  /// Overwrites prescribed components with their velocity at t (central difference of a prescribed displacement).
  virtual void prescribe_velocity(double t, FieldView v) = 0;
  /// Overwrites prescribed displacement components (quasi-static runs; t the load parameter).
  virtual void prescribe_displacement(double t, FieldView u) = 0;

  // Time step.
  /// Largest eigenvalue of M^-1 K at u [1/s^2]: Lanczos iteration on the exact tangent, plus its residual bound. Later calls start
  /// from the last eigenvector.
  virtual double largest_eigenvalue(ConstFieldView u) = 0;
  /// The bond-based estimate P 3.58 of the stable step [s], for comparison.
  virtual double bond_based_time_step() const = 0;
  /// False where the stiffness can grow during the run (nonlinear laws): the step is then re-estimated.
  virtual bool constant_stiffness() const noexcept = 0;
};

struct IntegratorTraits {
  bool dynamic = false;            ///< needs densities; writes velocity
  bool quasi_static = false;       ///< time is a load parameter in [0, 1]; plain numbers of boundaries and loads ramp
};

class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual IntegratorTraits traits() const noexcept = 0;
  /// What `perikit check` prints: "12 000 steps of 1.2e-7 s". May evaluate the tangent.
  virtual std::string plan(Problem&) { return {}; }
  /// Runs from the problem's present state, which may be one that `restore` brought back, to the end. Throws RunError.
  virtual void run(Problem&, Observer&) = 0;
};

}  // namespace perikit
