// What a problem does where bonds fail: impulses go to its points, and its forces and energies become those of the bonds that are left.
#include <fmt/format.h>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/field_operations.hpp"
#include "problem/body_problem.hpp"
#include "problem/bonds/crossed_faces.hpp"
#include "problem/loose/weak_springs.hpp"
#include "problem/saved/bond_record.hpp"

namespace perikit {

bool BodyProblem::update_bonds(const Configuration& at, double elapsed, FieldView velocity) {
  const ConstFieldView u = at.u();
  const Configuration reached(u, at.time(), 0, velocity);
  driven_work_.end(reached);
  if (!parts_.fracture) return false;
  const Seen whole = seen(u, seen_);
  const Configuration end = at.moved_to(whole);
  std::vector<std::int32_t> moved;
  const BondUpdate update = velocity.data ? fail_inside(end, elapsed, velocity, moved) : parts_.fracture->update(end, elapsed);
  dissipate(update.dissipated);
  if (update.changed == 0) return false;
  if (velocity.data) {
    renew_forces(reached, moved, update.ends);
    driven_work_.begin(reached);
  }
  find_pieces(true);
  return true;
}

void BodyProblem::dissipate(double energy) {
  state().energies.dissipated += energy;
  state().energies.strain -= energy;  // explicit steps take it anew
}

/// Bonds fail inside of the explicit step that ends here, in two halves: points that lost bonds in the first one are elsewhere in the second.
BondUpdate BodyProblem::fail_inside(const Configuration& end, double elapsed, FieldView velocity, std::vector<std::int32_t>& moved) {
  BondUpdate update;
  Fracture& fracture = *parts_.fracture;
  if (!fracture.find(end, elapsed)) return update;
  const FieldView u = state().displacement();
  if (before_.size() == 0) before_ = make_field();
  for (const bool early : {true, false}) {
    combine(1, u, -elapsed, velocity, before_);
    surroundings_.share(before_);
    if (images()) images()->extend(before_);
    const BondImpulse impulse = fracture.fail(early, before_, end, elapsed, update);
    if (!impulse.force.data) continue;
    const double growth = push(impulse.force, impulse.time, (1 - impulse.moment) * elapsed, velocity, moved);
    update.dissipated -= impulse.lag * growth;
    // The displacements of `end` follow.
    if (images()) seen(u, seen_);
    else surroundings_.share(u);
  }
  fracture.finish(update);
  return update;
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
  if (surroundings_.any() || weak_springs_) {
    status = evaluate_forces(at, state().internal_force(), energy);
  } else {
    status = terms().renew_forces(at, moved, lost, state().internal_force(), energy);
    describe(status);
  }
  if (!status.ok()) throw RunError("after bonds have failed: " + status.description);
}

std::int64_t BodyProblem::failed_bonds() const { return parts_.fracture ? static_cast<std::int64_t>(parts_.fracture->checks().failed) : 0; }

std::string BodyProblem::crossed_faces() {
  if (!parts_.fracture && body().cracks().empty()) return {};
  CrossedFaces found = find_crossed_faces(*parts_.families, seen(state().displacement(), seen_));
  communicator().sum({&found.points, 1});
  if (found.points == 0) return {};
  return fmt::format("faces of cracks pass through each other at {} points, by up to {:.2g} of the distance of both sides: bonds that have failed or are "
                     "cut resist no pressure, and there is no contact",
                     found.points, communicator().largest(found.deepest));
}

std::vector<std::byte> BodyProblem::bonds() const {
  ByteWriter out;
  if (parts_.fracture) BondRecord::write_here(parts_.fracture.get(), out);
  return out.take();
}

void BodyProblem::restore_bonds(std::span<const std::byte> bonds) {
  ByteReader in(bonds);
  BondRecord::read_here(in, parts_.fracture.get());
  driven_work_.begin(configuration());
  find_pieces(false);
}

std::string BodyProblem::fracture_summary() const {
  const Energies& e = values_.state.energies;
  return parts_.fracture ? parts_.fracture->summary(e.dissipated - e.dissipated_by_laws) : "";
}

}  // namespace perikit
