#include "problem/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

std::vector<const Body*> bodies_of(const std::vector<World::Member>& members) {
  std::vector<const Body*> bodies;
  for (const World::Member& member : members) bodies.push_back(&member.terms->body());
  return bodies;
}

/// What a body sees of a configuration, all of which is there.
class OfSlice {
 public:
  OfSlice(const Points::Slice& slice, const Configuration& at, ConstFieldView u)
      : own_(slice.of(u), at.time(), at.time_step(), slice.of(at.velocity())), external_(at.external().begin(), at.external().end()) {
    for (ExternalValue& value : external_) value.field = slice.of(value.field);
    if (!at.ends_step()) own_ = own_.moved_to(slice.of(u));
    own_ = own_.with_external(external_);
  }
  operator const Configuration&() const noexcept { return own_; }

 private:
  Configuration own_;
  std::vector<ExternalValue> external_;
};

}  // namespace

World::World(std::vector<Member> bodies, std::vector<std::unique_ptr<Term>> between)
    : members_(std::move(bodies)), points_(bodies_of(members_)), between_(std::move(between)) {
  for (const auto& term : between_)
    if (term->stateful() || term->driven() || term->breakable()) throw std::invalid_argument("a term between bodies that remembers, is driven or knows bonds");
  // What looks for bonds takes fields as one piece of memory.
  if (members_.size() > 1 && std::ranges::any_of(members_, [](const Member& member) { return member.fracture != nullptr; }))
    throw std::invalid_argument("several bodies of which bonds may fail");
}

template <class Evaluate>
EvaluationStatus World::each_body(Evaluate&& evaluate) {
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const Points::Slice& slice = points_.slices()[k];
    EvaluationStatus status = evaluate(*members_[k].terms, slice);
    if (status.ok()) continue;
    status.point += slice.first_number;
    status.description += fmt::format(" of the body \"{}\"", members_[k].name);
    return status;
  }
  return {};
}

template <class Add>
EvaluationStatus World::each_between(Add&& add) {
  for (const auto& term : between_) {
    const std::int64_t bad = add(*term);
    if (bad < 0) continue;
    const Points::Slice& slice = points_.slice_of(static_cast<std::size_t>(bad));
    const auto body = static_cast<std::size_t>(&slice - points_.slices().data());
    EvaluationStatus status = members_[body].terms->status(bad - static_cast<std::int64_t>(slice.first), term.get());
    status.point += slice.first_number;
    return status;
  }
  return {};
}

double World::stored_in(std::span<const GroupEnergy> energies) const {
  ExactSum sum;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const Points::Slice& slice = points_.slices()[k];
    members_[k].terms->add_owned(energies.subspan(slice.first / padding, slice.body->stride() / padding), &GroupEnergy::stored, sum);
  }
  return total_over_ranks(sum);
}

EvaluationStatus World::forces(const Configuration& at, FieldView force, double* energy) {
  if (alone()) return members_.front().terms->forces(at, force, energy);
  const ConstFieldView u = at.u();
  double stored = 0;
  EvaluationStatus status = each_body([&](Terms& terms, const Points::Slice& slice) {
    double of_body = 0;
    const EvaluationStatus own = terms.forces(OfSlice(slice, at, u), slice.of(force), energy ? &of_body : nullptr);
    stored += of_body;
    return own;
  });
  if (!status.ok()) return status;
  std::vector<GroupEnergy> energies;
  status = each_between([&](Term& term) {
    if (energy) energies.assign(points_.stride() / padding, {});
    const std::int64_t bad = term.forces(at.seen_as(u), {}, {force, energies});
    if (energy) stored += stored_in(energies);
    return bad;
  });
  if (energy) *energy = stored;
  return status;
}

EvaluationStatus World::tangent(const Configuration& at, ConstFieldView w, FieldView Kw) {
  if (alone()) return members_.front().terms->tangent(at, w, Kw);
  const ConstFieldView u = at.u();
  const EvaluationStatus status =
      each_body([&](Terms& terms, const Points::Slice& slice) { return terms.tangent(OfSlice(slice, at, u), slice.of(w), slice.of(Kw)); });
  if (!status.ok()) return status;
  return each_between([&](Term& term) { return term.tangent(at.moved_to(u), w, {}, Kw); });
}

bool World::constant_tangent() const noexcept {
  return std::ranges::all_of(members_, [](const Member& member) { return member.terms->constant_tangent(); }) &&
         std::ranges::all_of(between_, [](const auto& term) { return term->constant_tangent(); });
}

double World::accept() {
  double dissipated = 0;
  for (const Member& member : members_) dissipated += member.terms->accept();
  return dissipated;
}

void World::revert() {
  for (const Member& member : members_) member.terms->revert();
}

}  // namespace perikit
