#include "problem/body_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/fingerprint.hpp"
#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "problem/bonds/near_bonds.hpp"
#include "problem/companion.hpp"
#include "problem/loose/loose_points.hpp"
#include "problem/loose/weak_springs.hpp"
#include "problem/surroundings/image_gradients.hpp"

namespace perikit {

namespace {

void refuse_ranks(const ProblemParts& parts) {
  if (parts.partition)
    throw RunError(
        "an assembled tangent needs the whole body on one rank; allowed: matrix-free solvers, without a preconditioner or with the companion");
}

}  // namespace

BodyProblem::BodyProblem(ProblemParts parts, ProblemValues values)
    : Problem(values_),
      parts_(std::move(parts)),
      values_(std::move(values)),
      driven_work_(*parts_.terms, values_.state),
      surroundings_(parts_.partition.get(), parts_.images.get(), values_.points.dimension()),
      world_({{"body", parts_.terms.get(), parts_.fracture.get()}}),
      saved_state_(values_.points, values_.constraints, parts_.fracture.get(), *parts_.terms, values_.state) {
  driven_work_.begin({state().displacement(), state().time, 0, terms().driven_by_velocity() ? state().velocity() : FieldView{}});
}

BodyProblem::~BodyProblem() = default;

ProblemParts::ProblemParts() = default;
ProblemParts::ProblemParts(ProblemParts&&) noexcept = default;
ProblemParts::~ProblemParts() = default;

namespace {

std::uint64_t fingerprint_of(ConstFieldView u) {
  Fingerprint fingerprint;
  fingerprint.add(std::span(u.data, u.size()));
  return fingerprint.value();
}

}  // namespace

EvaluationStatus BodyProblem::sample(PointSamples& samples) {
  const ConstFieldView u = state().displacement();
  const bool there = kept_ && kept_->asked == samples.asked && kept_at_ == fingerprint_of(u);
  if (!there) return terms().sample({seen(u, seen_), state().time}, samples);
  samples = *std::exchange(kept_, std::nullopt);
  return {};
}

void BodyProblem::describe(EvaluationStatus& status) const {
  if (status.ok()) return;
  if (status.step_factor < 1) {
    status.description = fmt::format("the material {} asks for a step of {:.3g} of this length {}", parts_.materials[status.material], status.step_factor, status.description);
    return;
  }
  status.description = fmt::format("inadmissible deformation {}, kinematics {}, material {}", status.description, parts_.kinematics, parts_.materials[status.material]);
}

EvaluationStatus BodyProblem::evaluate_forces(const Configuration& at, FieldView force, double* energy) {
  const ConstFieldView u = at.unfinished();
  EvaluationStatus status;
  kept_.reset();
  const Sampling asked = std::exchange(along_, Sampling::nothing);
  if (at.motion() && (!at.motion()->inside() || asked != Sampling::nothing || surroundings_.any())) at.motion()->finish();
  // Where histories go on or bonds fail between forces and samples these are others.
  if (asked != Sampling::nothing && !terms().material_points() && !ghosts() && !parts_.fracture && at.external().empty()) {
    PointSamples samples{.asked = asked};
    status = terms().forces_and_samples(at.seen_as(seen(u, seen_)), force, energy, samples);
    if (status.ok()) kept_ = std::move(samples);
    kept_at_ = fingerprint_of(u);
  } else {
    status = surroundings_.arriving(at, seen_, [&](const Configuration& seen_at) { return world_.forces(seen_at, force, energy); });
  }
  describe(status);
  energy_wanted_ = energy != nullptr;
  // What is looked for on all ranks, all ranks look for: whether there are loose pieces they all know, whether forces are there they are to agree upon.
  if (weak_springs_ && weak_springs_->any()) {
    surroundings_.agree(status);
    if (status.ok() && weak_springs_->hold()) weak_springs_->add_forces(u, force, energy);
    else if (status.ok()) status = weak_springs_->refuse(seen(u, seen_));
  }
  finish(force, status);
  return status;
}

EvaluationStatus BodyProblem::external_forces(const Configuration& at, FieldView force) {
  if (!loads().follow()) {
    loads().evaluate(at.time(), force);
    if (ghosts() && images()) ghosts()->clear(force);
    return {};
  }
  PointSamples samples{.asked = Sampling::H};
  EvaluationStatus status = terms().sample(at.moved_to(seen(at.u(), seen_)), samples);
  surroundings_.agree(status);
  if (!status.ok()) return status;
  if (ghosts() && images()) {
    // Sources may be ghosts. As many components at a time as displacements have.
    const FieldView H = samples.H;
    for (int c = 0; c < H.components; c += dimension())
      surroundings_.share({H.component(c), H.stride, std::min(dimension(), H.components - c)});
  }
  if (images()) continue_gradients(*parts_.families, *images(), seen_, samples.H);
  loads().evaluate(at.time(), force, &samples.H);
  if (ghosts()) ghosts()->clear(force);
  return status;
}

EvaluationStatus BodyProblem::add_load_stiffness(const Configuration& at, ConstFieldView w, FieldView Kw) {
  const double largest = largest_magnitude(w);
  if (!loads().follow() || largest < std::numeric_limits<double>::min()) return {};   // motions without digits: the step would be infinite
  // cof F is quadratic in u: central differences have no error but rounding.
  const double step = 1e-3 * body().spacing() / largest;
  Field moved = make_field(), force = make_field();
  for (const double sign : {1.0, -1.0}) {
    combine(1, at.u(), sign * step, w, moved);
    const EvaluationStatus status = external_forces(at.moved_to(moved), force);
    if (!status.ok()) return status;
    combine(1, Kw, -sign / (2 * step), force, Kw);
  }
  return {};
}

EvaluationStatus BodyProblem::tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) {
  EvaluationStatus status = world_.tangent(at.moved_to(seen(at.u(), seen_)), seen(w, seen_direction_), Kw);
  if (weak_springs_ && weak_springs_->hold() && status.ok()) weak_springs_->add_tangent(w, Kw);
  finish(Kw, status);
  return status;
}

EvaluationStatus BodyProblem::assemble_tangent(const Configuration& at, BlockMatrix& K) {
  refuse_ranks(parts_);
  EvaluationStatus status;
  surroundings_.fold(K, tangent_of_terms_, [&](BlockMatrix& of_terms) { status = terms().assemble(at.moved_to(seen(at.u(), seen_)), of_terms); });
  if (status.ok()) hold_loose_points(parts_.families->changed(), K);
  if (status.ok() && weak_springs_ && weak_springs_->hold()) weak_springs_->add_to(K);
  return status;
}

AssembledSize BodyProblem::assembled_size() {
  refuse_ranks(parts_);
  AssembledSize size = terms().assembled_size();
  if (images()) size.bytes += size.blocks * static_cast<std::size_t>(dimension() * dimension()) * sizeof(double);   // it is there twice
  return size;
}

void BodyProblem::assemble_companion(ConstFieldView u, BlockMatrix& K, double most_bulk) {
  if (!companion_) companion_ = std::make_unique<Companion>(*parts_.families, laws());
  companion_->limit_bulk(most_bulk);
  surroundings_.fold(K, companion_of_terms_, [&](BlockMatrix& of_terms) {
    companion_->assemble(seen(u, seen_), of_terms);
    constexpr double end = 1;   // of the load parameter: the matrix does not depend on when it is made, and runs go on to the bit
    terms().add_stiffness_of_points({u, end}, of_terms);   // where a point is inadmissible, forces say so
  });
}

bool BodyProblem::constant_stiffness() const noexcept {
  return world_.constant_tangent() && !parts_.fracture;
}

void BodyProblem::accept() {
  const double dissipated = world_.accept();
  state().energies.dissipated += dissipated;
  state().energies.dissipated_by_laws += dissipated;
}

void BodyProblem::revert() { world_.revert(); }

void BodyProblem::find_pieces(bool fresh) {
  if (weak_springs_) weak_springs_->find(seen(state().displacement(), seen_), fresh);
}

std::string BodyProblem::watch_pieces(double weak_springs) {
  weak_springs_ = std::make_unique<WeakSprings>(*parts_.families, *this, terms(), weak_springs);
  find_pieces(true);
  return weak_springs_->names();
}

void BodyProblem::restore(std::span<const std::byte> bytes) {
  saved_state_.read_here(bytes);
  find_pieces(false);
}

void BodyProblem::restore(ByteReader& in) {
  saved_state_.read(in);
  find_pieces(false);
}

ModelReport BodyProblem::report() const {
  ModelReport report = terms().report();
  if (parts_.fracture) parts_.fracture->report(report);
  return report;
}

std::size_t BodyProblem::bytes() const noexcept {
  return body().bytes() + report().bytes + values_.state.bytes() + masses().bytes() + (near_bonds_ ? near_bonds_->bytes() : 0);
}

}  // namespace perikit
