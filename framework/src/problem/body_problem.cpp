#include "problem/body_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/fingerprint.hpp"
#include "core/ranks/dependent_arrival.hpp"
#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "problem/companion.hpp"
#include "problem/crossed_faces.hpp"
#include "problem/history_record.hpp"
#include "problem/image_gradients.hpp"
#include "problem/loose/loose_points.hpp"
#include "problem/loose/weak_springs.hpp"
#include "problem/near_bonds.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

namespace {

/// Images follow their sources, some of which are ghosts.
class Extension final : public DependentArrival {
 public:
  Extension(Arrival& ghosts, const ImageMap& images, FieldView u) : DependentArrival(&ghosts), images_(images), u_(u) {}

 private:
  void put() override { images_.extend(u_); }

  const ImageMap& images_;
  FieldView u_;
};

void refuse_ranks(const ProblemParts& parts) {
  if (parts.partition)
    throw RunError(
        "an assembled tangent needs the whole body on one rank; allowed: matrix-free solvers, without a preconditioner or with the companion");
}

}  // namespace

BodyProblem::BodyProblem(ProblemParts parts, ProblemValues values)
    : Problem(values_), parts_(std::move(parts)), values_(std::move(values)), driven_work_(*parts_.terms, values_.state) {
  if (parts_.partition) ghosts_.emplace(*parts_.partition, dimension());
  if (parts_.images) seen_ = make_field();
  driven_work_.begin({state().displacement(), state().time, 0, terms().driven_by_velocity() ? state().velocity() : FieldView{}});
}

BodyProblem::~BodyProblem() = default;

ProblemParts::ProblemParts() = default;
ProblemParts::ProblemParts(ProblemParts&&) noexcept = default;
ProblemParts::~ProblemParts() = default;

namespace {

/// A failure on one rank is one on all of them, which must say the same: that of the point that comes first.
void agree(EvaluationStatus& status) {
  if (communicator().size() == 1 || communicator().largest(status.ok() ? 0.0 : 1.0) == 0) return;
  std::vector<std::byte> mine;
  if (!status.ok()) {
    ByteWriter out;
    out.value(status.point);
    out.bytes(status.description.data(), status.description.size());
    mine = out.take();
  }
  std::vector<std::byte> first;
  std::int64_t least = -1;
  for (const std::vector<std::byte>& of_rank : communicator().gather(mine)) {
    if (of_rank.empty()) continue;
    const auto point = ByteReader(of_rank).value<std::int64_t>();
    if (least >= 0 && point >= least) continue;
    least = point;
    first = of_rank;
  }
  communicator().broadcast(first);
  ByteReader in(first);
  status.point = in.value<std::int64_t>();
  status.description.assign(first.size() - sizeof status.point, ' ');
  in.bytes(status.description.data(), status.description.size());
}

}  // namespace

BodyProblem::Seen BodyProblem::seen(ConstFieldView u, Field& memory) {
  if (images()) {
    copy(u, memory);
    if (ghosts_) ghosts_->forward(memory);
    images()->extend(memory);
    return {memory, nullptr};
  }
  return shared(u);
}

BodyProblem::Seen BodyProblem::shared(ConstFieldView field) {
  if (ghosts_) ghosts_->forward(Seen::writable(field));
  return {field, ghosts()};
}

void BodyProblem::settle(FieldView force) const {
  if (images()) images()->fold(force);
  if (ghosts_) ghosts_->clear(force);
}

void BodyProblem::finish(FieldView force, EvaluationStatus& status) {
  if (ghosts_) agree(status);
  if (status.ok()) settle(force);
}

template <class Fill>
void BodyProblem::over_own(BlockMatrix& K, BlockMatrix& full, Fill&& fill) const {
  if (!images()) return fill(K);
  full.convex = K.convex;
  fill(full);
  images()->fold(full, K);
}

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
  status.description = fmt::format("inadmissible deformation {}, kinematics {}, material {}", status.description, parts_.kinematics, parts_.materials[status.material]);
}

void BodyProblem::share(FieldView field) {
  if (ghosts_) ghosts_->forward(field);
}

EvaluationStatus BodyProblem::evaluate_forces(const Configuration& at, FieldView force, double* energy) {
  const ConstFieldView u = at.unfinished();
  EvaluationStatus status;
  kept_.reset();
  const Sampling asked = std::exchange(along_, Sampling::nothing);
  if (at.motion() && (!at.motion()->inside() || asked != Sampling::nothing || ghosts_ || images())) at.motion()->finish();
  const auto seen_at = [&](ConstFieldView seen) { return Configuration(seen, at.time(), at.time_step(), at.velocity()); };
  // Where histories go on or bonds fail between forces and samples these are others.
  if (asked != Sampling::nothing && !terms().material_points() && !ghosts_ && !parts_.fracture.damage()) {
    PointSamples samples{.asked = asked};
    status = terms().forces_and_samples(seen_at(seen(u, seen_)), force, energy, samples);
    if (status.ok()) kept_ = std::move(samples);
    kept_at_ = fingerprint_of(u);
  } else if (!ghosts_) {
    status = terms().forces(images() ? seen_at(seen(u, seen_)) : at, force, energy);
  } else if (!images()) {
    ghosts_->start(Seen::writable(u));
    status = terms().forces(seen_at(Seen(u, ghosts())).arriving(*ghosts_), force, energy);
  } else {
    copy(u, seen_);
    ghosts_->start(seen_);
    Extension extension(*ghosts_, *images(), seen_);
    status = terms().forces(seen_at(seen_).arriving(extension), force, energy);
  }
  describe(status);
  energy_wanted_ = energy != nullptr;
  // What is looked for on all ranks, all ranks look for.
  if (ghosts_ && weak_springs_ && weak_springs_->any()) agree(status);
  if (weak_springs_ && status.ok()) {
    if (weak_springs_->hold()) weak_springs_->add_forces(u, force, energy);
    else status = weak_springs_->refuse(seen(u, seen_));
  }
  finish(force, status);
  return status;
}

EvaluationStatus BodyProblem::external_forces(const Configuration& at, FieldView force) {
  if (!loads().follow()) {
    loads().evaluate(at.time(), force);
    if (ghosts_ && images()) ghosts_->clear(force);
    return {};
  }
  PointSamples samples{.asked = Sampling::H};
  EvaluationStatus status = terms().sample(at.moved_to(seen(at.u(), seen_)), samples);
  agree(status);
  if (!status.ok()) return status;
  if (ghosts_ && images()) {
    // Sources may be ghosts. As many components at a time as displacements have.
    const FieldView H = samples.H;
    for (int c = 0; c < H.components; c += dimension())
      ghosts_->forward({H.component(c), H.stride, std::min(dimension(), H.components - c)});
  }
  if (images()) continue_gradients(*parts_.families, *images(), seen_, samples.H);
  loads().evaluate(at.time(), force, &samples.H);
  if (ghosts_) ghosts_->clear(force);
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
  if (images() && seen_direction_.size() == 0) seen_direction_ = make_field();
  EvaluationStatus status = terms().tangent(at.moved_to(seen(at.u(), seen_)), seen(w, seen_direction_), Kw);
  if (weak_springs_ && weak_springs_->hold() && status.ok()) weak_springs_->add_tangent(w, Kw);
  finish(Kw, status);
  return status;
}

EvaluationStatus BodyProblem::assemble_tangent(const Configuration& at, BlockMatrix& K) {
  refuse_ranks(parts_);
  EvaluationStatus status;
  over_own(K, tangent_of_terms_, [&](BlockMatrix& of_terms) { status = terms().assemble(at.moved_to(seen(at.u(), seen_)), of_terms); });
  if (status.ok()) hold_loose_points(terms().changed_bonds(), K);
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
  over_own(K, companion_of_terms_, [&](BlockMatrix& of_terms) {
    companion_->assemble(seen(u, seen_), of_terms);
    constexpr double end = 1;   // of the load parameter: the matrix does not depend on when it is made, and runs go on to the bit
    terms().add_stiffness_of_points({u, end}, of_terms);   // where a point is inadmissible, forces say so
  });
}

bool BodyProblem::constant_stiffness() const noexcept {
  return terms().constant_tangent() && !parts_.fracture.damage();
}

void BodyProblem::accept() {
  const double dissipated = terms().accept();
  state().energies.dissipated += dissipated;
  state().energies.dissipated_by_laws += dissipated;
}

void BodyProblem::revert() { terms().revert(); }

bool BodyProblem::update_bonds(const Configuration& at, double elapsed, FieldView velocity) {
  const ConstFieldView u = at.u();
  const Configuration reached(u, at.time(), 0, velocity);
  driven_work_.end(reached);
  if (!parts_.fracture.damage()) return false;
  const Seen whole = seen(u, seen_);
  std::vector<std::int32_t> moved;
  StepInside step;
  if (velocity.data) {
    step.begin = [&](FieldView before) {
      combine(1, u, -elapsed, velocity, before);
      if (ghosts_) ghosts_->forward(before);
      if (images()) images()->extend(before);
    };
    step.act = [&](FieldView force, double time, double moment) {
      const double growth = push(force, time, (1 - moment) * elapsed, velocity, moved);
      // `whole` follows.
      if (images()) seen(u, seen_);
      else if (ghosts_) ghosts_->forward(Seen::writable(u));
      return growth;
    };
  }
  const BondUpdate update = parts_.fracture.update(terms(), at.moved_to(whole), elapsed, state(), step);
  if (update.changed == 0) return false;
  if (velocity.data) {
    renew_forces(reached, moved, update.ends);
    driven_work_.begin(reached);
  }
  find_pieces(true);
  return true;
}

void BodyProblem::find_pieces(bool fresh) {
  if (weak_springs_) weak_springs_->find(seen(state().displacement(), seen_), fresh);
}

/// What holds a component takes the impulse upon it; its work is that of all other forces, with the opposite sign.
double BodyProblem::push(FieldView force, double time, double since, FieldView velocity, std::vector<std::int32_t>& moved) {
  EvaluationStatus status;
  finish(force, status);
  const FieldView u = state().displacement(), internal = state().internal_force();
  const ConstFieldView external = loads().any() ? state().external_force() : FieldView{};
  const std::span<const double> by_point = masses().by_point();
  const ConstFieldView free = constraints().free();
  ExactSum growth, held;
  for (int c = 0; c < velocity.components; ++c)
    for (std::size_t p = 0; p < velocity.stride; ++p) {
      const double f = force.component(c)[p];
      if (f == 0) continue;   // far from bonds that failed
      double& v = velocity.component(c)[p];
      internal.component(c)[p] -= f;
      if (!(by_point[p] > 0) || free.component(c)[p] == 0) {
        held.add(f * v);
        continue;
      }
      const double left = internal.component(c)[p] + (external.data ? external.component(c)[p] : 0.0);
      growth.add(f * left / by_point[p]);
      const double change = time * f / by_point[p];
      v += change;
      u.component(c)[p] += since * change;
      moved.push_back(static_cast<std::int32_t>(p));
    }
  state().energies.external_work -= time * total_over_ranks(held);
  return total_over_ranks(growth);
}

void BodyProblem::renew_forces(const Configuration& at, std::span<const std::int32_t> moved, std::span<const std::int32_t> lost) {
  double* const energy = energy_wanted_ ? &state().energies.strain : nullptr;
  EvaluationStatus status;
  if (ghosts_ || images() || weak_springs_) {
    status = evaluate_forces(at, state().internal_force(), energy);
  } else {
    status = terms().renew_forces(at, moved, lost, state().internal_force(), energy);
    describe(status);
  }
  if (!status.ok()) throw RunError("after bonds have failed: " + status.description);
}

std::string BodyProblem::watch_pieces(double weak_springs) {
  weak_springs_ = std::make_unique<WeakSprings>(*parts_.families, *this, terms(), weak_springs);
  find_pieces(true);
  return weak_springs_->names();
}

std::int64_t BodyProblem::failed_bonds() const { return static_cast<std::int64_t>(terms().bond_checks().failed); }

std::string BodyProblem::crossed_faces() {
  if (!parts_.fracture.damage() && body().cracks().empty()) return {};
  CrossedFaces found = find_crossed_faces(*parts_.families, seen(state().displacement(), seen_));
  communicator().sum({&found.points, 1});
  if (found.points == 0) return {};
  return fmt::format("faces of cracks pass through each other at {} points, by up to {:.2g} of the distance of both sides: bonds that have failed or are "
                     "cut resist no pressure, and there is no contact",
                     found.points, communicator().largest(found.deepest));
}

std::vector<std::byte> BodyProblem::bonds() const {
  ByteWriter out;
  if (parts_.fracture.damage()) parts_.fracture.write_here(terms(), out);
  return out.take();
}

void BodyProblem::restore_bonds(std::span<const std::byte> bonds) {
  ByteReader in(bonds);
  parts_.fracture.read_here(terms(), in);
  driven_work_.begin(configuration());
  find_pieces(false);
}

namespace {

/// Of snapshots, which begin with it; the first ones began with a stride, a multiple of 8.
constexpr std::uint64_t snapshot_format = 2;

std::uint64_t stride_of(ByteReader& in) {
  if (in.value<std::uint64_t>() != snapshot_format)
    throw InputError("the saved state has another layout than this version of perikit reads");
  return in.value<std::uint64_t>();
}

}  // namespace

void BodyProblem::write_snapshot(const std::function<void(std::uint64_t)>& begin,
                                 const std::function<void(std::span<const std::byte>)>& next) const {
  const bool first = communicator().rank() == 0;
  const HistoryRecord history(terms());
  ByteWriter head;
  head.value(snapshot_format);
  head.value(static_cast<std::uint64_t>(body().stride_of_all_ranks()));
  values_.constraints.write(head);
  const std::vector<std::byte> bytes = head.take();
  const std::uint64_t size = bytes.size() + parts_.fracture.written(terms()) + history.written() + values_.state.written();
  if (first) begin(size);
  ByteWriter out([&](std::span<const std::byte> piece) {
    if (first) next(piece);
  });
  out.bytes(bytes.data(), bytes.size());
  parts_.fracture.write(terms(), out);
  history.write(out);
  values_.state.write(out);
  out.finish();
}

std::vector<std::byte> BodyProblem::snapshot() const {
  ByteWriter out;
  out.value(static_cast<std::uint64_t>(body().stride()));
  values_.constraints.write(out);
  parts_.fracture.write_here(terms(), out);
  HistoryRecord::write_here(terms(), out);
  values_.state.write_here(out);
  return out.take();
}

void BodyProblem::restore(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.value<std::uint64_t>() != body().stride()) throw InputError("the saved state belongs to another body");
  constraints().read(in);
  parts_.fracture.read_here(terms(), in);
  HistoryRecord::read_here(in, terms());
  state().read_here(in);
  if (!in.done()) throw InputError("the saved state is damaged");
  find_pieces(false);
}

void BodyProblem::restore(ByteReader& in) {
  if (stride_of(in) != body().stride_of_all_ranks()) throw InputError("the saved state belongs to another body");
  constraints().read(in);
  parts_.fracture.read(terms(), in);
  HistoryRecord::read(in, terms());
  state().read(in);
  if (!in.done()) throw InputError("the saved state is damaged");
  find_pieces(false);
}

BodyProblem::Carried BodyProblem::carried_by(ByteReader& snapshot) {
  stride_of(snapshot);
  snapshot.value<double>();  // of the constraints
  Carried carried;
  FractureRecord::read_bonds(snapshot, [&](std::span<const NamedChange> bonds) { carried.bonds += bonds.size(); });
  carried.history = HistoryRecord::count(snapshot);
  return carried;
}

void BodyProblem::carry(ByteReader& snapshot) {
  if (stride_of(snapshot) != body().stride_of_all_ranks()) throw InputError("the earlier run had another body");
  snapshot.value<double>();      // of the constraints
  std::vector<BondChange> lost;  // of the bonds that cracks of this scene leave
  bool any = false;
  FractureRecord::read_bonds(snapshot, [&](std::span<const NamedChange> bonds) {
    any = true;
    for (const BondChange& change : terms().bonds_here(bonds))
      if (parts_.families->integrity(change.bond) > change.integrity) lost.push_back(change);
  });
  // On several ranks all of them restore, whoever has such bonds.
  if (!lost.empty() || (ghosts_ && any)) terms().restore_bonds(lost);
  HistoryRecord::read(snapshot, terms());
}

std::size_t BodyProblem::bytes() const noexcept {
  return body().bytes() + terms().report().bytes + values_.state.bytes() + masses().bytes() + (near_bonds_ ? near_bonds_->bytes() : 0);
}

}  // namespace perikit
