#include "families/families.hpp"

#include <algorithm>

#include "core/each_once.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/normalised_influence.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

std::unique_ptr<Families> Families::make(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs) {
  if (needs.influence) influence = normalised(std::move(influence));
  if (body.lattice()) return std::make_unique<LatticeFamilies>(body, std::move(influence), needs);
  return std::make_unique<CloudFamilies>(body, std::move(influence), needs);
}

std::vector<std::int32_t> Families::lower(std::span<const BondChange> changes) {
  ++version_;
  return set_bonds(changes);
}

std::vector<std::int32_t> Families::raise(std::span<const BondChange> before) {
  ++version_;
  return set_bonds(before);
}

std::vector<std::int32_t> Families::mend() {
  ++version_;
  return mend_bonds();
}

void Families::let_fail() {
  if (fails_) return;
  fails_ = true;
  make_room();
}

GroupMarks Families::evaluated(GroupMarks marks) const {
  if (lattice()) mark_whole_runs(1, marks);
  return marks;
}

GroupMarks Families::marks_of(std::span<const std::int32_t> points) const {
  GroupMarks marks(body_.stride() / padding, 0);
  for (const std::int32_t p : points) perikit::mark(marks, static_cast<std::size_t>(p));
  return evaluated(std::move(marks));
}

GroupMarks Families::around(const GroupMarks& marks) const {
  std::vector<std::int32_t> points;
  for (std::size_t group = 0; group < marks.size(); ++group)
    for (std::size_t p = group * padding; marks[group] && p < (group + 1) * padding; ++p)
      if (marked(marks, p) && body_.alive(p)) points.push_back(static_cast<std::int32_t>(p));
  GroupMarks reached(marks.size(), 0);
  mark(points, reached);
  return reached;
}

std::vector<BondId> Families::fragment_bonds(std::span<const std::int32_t> points) const {
  std::vector<BondId> bonds;
  FamilyArrays family;
  for (const std::int32_t p : points) {
    if (!needs_.shapes || !is_fragment(static_cast<std::size_t>(p))) continue;
    load(static_cast<std::size_t>(p), BondsOf::intact, family);
    for (const std::int32_t far : family.far) bonds.push_back(BondId::of(p, far));
  }
  keep_each_once(bonds);
  return bonds;
}

void bond_shares(const Families& families, std::size_t p, BondWeight kind, const FamilyArrays& family, AlignedVector<double>& share) {
  const double normaliser = families.normaliser(p, kind);
  share.assign(family.size, 0.0);
  for (std::size_t k = 0; k < family.far.size(); ++k)
    share[k] = family.volume[k] * (kind == BondWeight::kernel ? family.omega[k] : family.b(k)) / normaliser;
}

namespace {

template <class Value>
Field by_point(const Families& families, const Value& value) {
  Field out = families.body().make_field(1);
  for (const std::int32_t p : families.body().internal()) out.data()[p] = value(static_cast<std::size_t>(p));
  return out;
}

}  // namespace

Field damage_field(const Families& families) {
  return by_point(families, [&](std::size_t p) { return families.damage(p); });
}

Field condition_field(const Families& families) {
  return by_point(families, [&](std::size_t p) { return families.condition(p); });
}

}  // namespace perikit
