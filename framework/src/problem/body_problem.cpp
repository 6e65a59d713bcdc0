#include "perikit/problem/body_problem.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/problem/motion.hpp"
#include "problem/companion.hpp"
#include "problem/loose_points.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

namespace {

/// u with the values of ghosts, in `memory`; u itself where there are none.
ConstFieldView filled(const std::optional<Ghosts>& ghosts, ConstFieldView u, Field& memory) {
  if (!ghosts) return u;
  std::copy_n(u.data, u.size(), memory.data());
  ghosts->forward(memory);
  return memory;
}

/// Ends an evaluation: forces on ghosts go to their owners; one status for all ranks.
void finish(const std::optional<Ghosts>& ghosts, FieldView force, EvaluationStatus& status) {
  if (!ghosts) return;
  if (communicator().largest(status.ok() ? 0.0 : 1.0) == 0) return ghosts->accumulate(force);
  if (status.ok()) status = {0, "inadmissible deformation on another rank"};
}

void refuse_ranks(const ProblemParts& parts) {
  if (parts.partition)
    throw RunError(
        "an assembled tangent needs the whole body on one rank; allowed: matrix-free solvers without a preconditioner");
}

}  // namespace

BodyProblem::BodyProblem(ProblemParts parts, ProblemValues values)
    : Problem(values_), parts_(std::move(parts)), values_(std::move(values)) {
  if (!parts_.partition) return;
  ghosts_.emplace(*parts_.partition, body());
  with_ghosts_ = make_field();
  direction_with_ghosts_ = make_field();
}

BodyProblem::~BodyProblem() = default;

ProblemParts::ProblemParts() = default;
ProblemParts::ProblemParts(ProblemParts&&) noexcept = default;
ProblemParts::~ProblemParts() = default;

EvaluationStatus BodyProblem::evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step) {
  LawHistory* const history = terms().history();
  if (history) history->set_time_step(time_step);
  EvaluationStatus status = terms().forces(filled(ghosts_, u, with_ghosts_), force, energy);
  if (energy) *energy = communicator().sum(*energy);
  if (history) history->set_time_step(0);
  if (!status.ok()) {
    const auto p = static_cast<std::size_t>(body().internal()[static_cast<std::size_t>(status.point)]);
    const std::size_t id = body().material_ids().empty() ? 0 : body().material_ids()[p];
    status.description = fmt::format("inadmissible deformation ({}) at {}, kinematics {}, material {}",
                                     terms().has_gradients() ? "det F <= 0 or not finite" : "a bond of zero or non-finite length",
                                     status.description, parts_.kinematics, parts_.materials[id]);
  }
  finish(ghosts_, force, status);
  return status;
}

EvaluationStatus BodyProblem::tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const ConstFieldView at = filled(ghosts_, u, with_ghosts_), along = filled(ghosts_, w, direction_with_ghosts_);
  EvaluationStatus status = terms().tangent(at, along, Kw);
  finish(ghosts_, Kw, status);
  return status;
}

EvaluationStatus BodyProblem::assemble_tangent(ConstFieldView u, BlockMatrix& K) {
  refuse_ranks(parts_);
  const EvaluationStatus status = terms().assemble(u, K);
  if (status.ok()) hold_loose_points(terms().changed_bonds(), K);
  return status;
}

AssembledSize BodyProblem::assembled_size() {
  refuse_ranks(parts_);
  return terms().assembled_size();
}

void BodyProblem::assemble_companion(ConstFieldView u, BlockMatrix& K) {
  refuse_ranks(parts_);
  if (!companion_) companion_ = std::make_unique<Companion>(*parts_.families, laws());
  companion_->assemble(u, K);
}

bool BodyProblem::constant_stiffness() const noexcept {
  return terms().has_gradients() && laws().constant_tangent() && !parts_.fracture.damage();
}

bool BodyProblem::advance(double time_step, ConstFieldView velocity) {
  if (terms().history()) terms().history()->advance();
  const Motion half_step = [&](FieldView end) { middle_of_next_step(*this, time_step, velocity, end); };
  return parts_.fracture.update(terms(), state(), time_step, velocity.data ? half_step : Motion());
}

std::vector<std::byte> BodyProblem::bonds() const {
  ByteWriter out;
  if (parts_.fracture.damage()) parts_.fracture.write(terms(), out);
  return out.take();
}

void BodyProblem::restore_bonds(std::span<const std::byte> bonds) {
  ByteReader in(bonds);
  parts_.fracture.read(terms(), in);
}

std::vector<std::byte> BodyProblem::snapshot() const {
  ByteWriter out;
  out.value(static_cast<std::uint64_t>(body().stride()));
  values_.constraints.write(out);
  parts_.fracture.write(terms(), out);
  out.numbers(terms().history() ? terms().history()->values() : std::span<double>());
  values_.state.write(out);
  return out.take();
}

void BodyProblem::restore(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.value<std::uint64_t>() != body().stride()) throw InputError("the saved state belongs to another body");
  constraints().read(in);
  parts_.fracture.read(terms(), in);
  const std::span<double> history = terms().history() ? terms().history()->values() : std::span<double>();
  if (in.value<std::uint64_t>() != history.size()) throw InputError("the saved state belongs to other materials");
  in.bytes(history.data(), history.size_bytes());
  terms().history_restored();
  state().read(in);
  if (!in.done()) throw InputError("the saved state is damaged");
}

std::size_t BodyProblem::bytes() const noexcept {
  return body().bytes() + terms().report().bytes + values_.state.bytes() + masses().bytes();
}

}  // namespace perikit
