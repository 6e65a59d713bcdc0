#include "terms/terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "assembly/block_pattern.hpp"
#include "body/interfaces.hpp"
#include "cloud_balance/consistency.hpp"
#include "core/symmetric_matrix.hpp"
#include "families/lattice/lattice_families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/warnings.hpp"
#include "terms/mechanics.hpp"
#include "terms/pairs/pair_forces.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// K += the blocks of a term whose tangent couples no two points: what it does to a motion of all points alike. convex: without their negative
/// curvatures, of a symmetric tangent. Returns as Term::forces does.
std::int64_t add_point_blocks(Term& term, const Body& body, const Configuration& at, bool convex, BlockMatrix& K) {
  const int d = body.dimension();
  const auto n = static_cast<std::size_t>(d);
  std::array<Field, 3> columns;
  for (int e = 0; e < d; ++e) {
    Field w = body.make_field(d);
    std::fill_n(w.component(e), w.stride(), 1.0);
    Field& column = columns[static_cast<std::size_t>(e)] = body.make_field(d);
    if (const std::int64_t bad = term.tangent(at, w, {}, column); bad >= 0) return bad;
  }
  for (std::size_t r = 0; r < K.rows(); ++r) {
    std::array<double, 9> block;
    for (std::size_t c = 0; c < n; ++c)
      for (std::size_t e = 0; e < n; ++e) block[c * n + e] = columns[e].component(static_cast<int>(c))[K.point[r]];
    if (convex) make_semidefinite(block.data(), d);
    for (auto b = static_cast<std::size_t>(K.row_first[r]); b < static_cast<std::size_t>(K.row_first[r + 1]); ++b)
      for (std::size_t k = 0; k < n * n && K.column[b] == static_cast<std::int32_t>(r); ++k) K.values[b * n * n + k] += block[k];
  }
  return -1;
}

}  // namespace

class Terms::PointBlocks final : public Assembly {
 public:
  PointBlocks(Term& term, const Body& body) : term_(term), body_(body) {}
  std::int64_t add(const Configuration& at, BlockMatrix& K) override {
    const bool symmetric = !term_.driven() || term_.driven()->conservative();
    if (!symmetric) K.symmetric = false;
    return add_point_blocks(term_, body_, at, K.convex && symmetric, K);
  }
  void bonds_changed() override {}
  std::size_t bytes() const noexcept override { return 0; }

 private:
  Term& term_;
  const Body& body_;
};

/// One assembly for each term, over common block rows.
struct Terms::Assemblies {
  BlockRows rows;
  std::vector<std::unique_ptr<Assembly>> all;
  std::size_t version;   ///< of the bonds that they know
  int steps = 1;
};

Terms::Terms(TermParts parts) : parts_(std::move(parts)) {
  const Formulation& formulation = parts_.formulation;
  const Families& families = *parts_.families;
  const std::shared_ptr<const Interfaces> meeting = parts_.interfaces && !parts_.interfaces->empty() ? parts_.interfaces : nullptr;
  if (formulation.pairs) {
    if (!parts_.factors) parts_.factors = find_bond_factors(formulation, families, *parts_.laws, {});
    terms_.push_back(make_pair_forces({families, formulation, *parts_.laws, parts_.skip, parts_.share, meeting, parts_.images, parts_.factors}));
  } else {
    auto mechanics = std::make_unique<Mechanics>(
        SpaceParts{families, formulation, *parts_.laws, parts_.skip, parts_.share, {}, meeting});
    if (parts_.consistency) mechanics->balance(parts_.consistency);
    terms_.push_back(std::move(mechanics));
  }
  if (parts_.stabilization) terms_.push_back(make_penalty({families, formulation, *parts_.laws, parts_.stabilization, parts_.skip}));
  for (const TermMaker& make : parts_.further) terms_.push_back(make(parts_));
  energies_.resize(terms_.size());
}

Terms::~Terms() = default;

EvaluationStatus Terms::at_point(std::int64_t point) const {
  EvaluationStatus status;
  const Body& body = parts_.families->body();
  const Point x = body.position(static_cast<std::size_t>(point));
  status.point = body.number(static_cast<std::size_t>(point));
  if (!body.material_ids().empty()) status.material = body.material_ids()[static_cast<std::size_t>(point)];
  status.description = fmt::format("at point {} at ({:.6g}, {:.6g}, {:.6g})", status.point, x[0], x[1], x[2]);
  return status;
}

EvaluationStatus Terms::status(std::int64_t bad, const Term* term) const {
  if (bad < 0) return {};
  EvaluationStatus status = at_point(bad);
  status.description = fmt::format("({}) {}", (term ? *term : *terms_.front()).inadmissible(), status.description);
  return status;
}

EvaluationStatus Terms::too_long_step(std::int64_t point, double factor) const {
  EvaluationStatus status = at_point(point);
  status.step_factor = factor;
  return status;
}

template <class Visit>
EvaluationStatus Terms::each_term(Visit&& visit) {
  for (const auto& term : terms_)
    if (const std::int64_t bad = visit(*term); bad >= 0) return status(bad, term.get());
  return {};
}

int Terms::coupling_reach() const {
  int reach = 1;
  for (const auto& term : terms_)
    if (const AssembledTerm* const assembled = term->assembled()) reach = std::max(reach, assembled->coupling_reach());
  return reach;
}

StatefulTerm* Terms::stateful() const noexcept { return terms_.front()->stateful(); }

std::size_t Terms::groups() const noexcept { return parts_.families->body().stride() / padding; }

void Terms::add_owned(std::span<const GroupEnergy> energies, double GroupEnergy::* which, ExactSum& sum) const {
  const Body& body = parts_.families->body();
  for (std::size_t g = 0; g < energies.size(); ++g)
    for (std::size_t p = g * padding; p < (g + 1) * padding; ++p) {
      if (!body.alive(p)) continue;
      if (body.owns(p)) sum.add(energies[g].*which);   // groups are of one rank's points
      break;
    }
}

namespace {

/// The points of the body <- 0. They may be a slice of the fields of several bodies.
void clear(const Body& body, FieldView field) {
  over_blocks(body.stride(), [&](std::size_t begin, std::size_t end) {
    for (int c = 0; c < field.components; ++c) std::fill(field.component(c) + begin, field.component(c) + end, 0.0);
  });
}

}  // namespace

/// add(term, sum) adds the forces of a term to `force`, which is zero.
template <class Add>
EvaluationStatus Terms::forces_by(Add&& add, const Configuration& at, FieldView force, double* energy) {
  if (screen_) screen_->begin();
  ExactSum stored;
  std::int64_t bad = -1;
  const Term* met = nullptr;
  StatefulTerm::ShorterStep shorter;
  for (std::size_t t = 0; t < terms_.size() && bad < 0; ++t) {
    met = terms_[t].get();
    StatefulTerm* const remembers = terms_[t]->stateful();
    const bool dissipates = remembers && remembers->dissipates() && at.ends_step();
    if (energy || dissipates) energies_[t].assign(groups(), {});
    bad = add(*terms_[t], ForceSum{force, energy || dissipates ? std::span(energies_[t]) : std::span<GroupEnergy>(), energy != nullptr, screen_});
    if (energy) add_owned(energies_[t], &GroupEnergy::stored, stored);
    if (remembers && at.ends_step() && bad < 0) shorter = remembers->shorter_step();
    if (!dissipates) continue;
    dissipated_ = {};
    add_owned(energies_[t], &GroupEnergy::dissipated, dissipated_);
  }
  if (screen_ && bad < 0) screen_->end(at.u());
  if (energy) *energy = total_over_ranks(stored);
  return bad < 0 && shorter.point >= 0 ? too_long_step(shorter.point, shorter.factor) : status(bad, met);
}

EvaluationStatus Terms::forces(const Configuration& at, FieldView force, double* energy) {
  if (!at.motion()) clear(body(), force);
  return forces_by([&](Term& term, const ForceSum& sum) { return term.forces(at, {}, sum); }, at, force, energy);
}

namespace {

/// As asked, before terms add to them.
void begin_samples(const Body& body, PointSamples& samples) {
  samples = {.asked = samples.asked};
  samples.strain_energy_density = body.make_field(1);
}

}  // namespace

EvaluationStatus Terms::forces_and_samples(const Configuration& at, FieldView force, double* energy, PointSamples& samples) {
  begin_samples(parts_.families->body(), samples);
  fill(0, force);
  return forces_by(
      [&](Term& term, const ForceSum& sum) {
        SampledTerm* const sampled = term.sampled();
        return sampled ? sampled->forces_and_samples(at, sum, samples) : term.forces(at, {}, sum);
      },
      at, force, energy);
}

/// 0 between its uses.
FieldView Terms::work_field(int components) {
  if (work_.size() == 0) work_ = body().make_field(components);
  return work_;
}

double Terms::add_forces(const Configuration& at, const Region& region, double factor, FieldView sum) {
  const FieldView own = work_field(at.u().components);
  ExactSum stored;
  std::vector<GroupEnergy> energies;
  std::int64_t bad = -1;
  for (const auto& term : terms_) {
    energies.assign(groups(), {});
    bad = std::max(bad, term->forces(at.moved_to(at.u()), region, {own, energies}));
    add_owned(energies, &GroupEnergy::stored, stored);
  }
  const bool ok = communicator().largest(bad >= 0 ? 1 : 0) == 0;
  const double energy = ok ? total_over_ranks(stored) : std::numeric_limits<double>::quiet_NaN();
  const GroupMarks& near = *region.gradients;
  for (std::size_t g = 0; g < near.size() && sum.data && std::isfinite(energy); ++g)
    for (int c = 0; c < own.components && near[g]; ++c)
      for (std::size_t p = g * padding; p < (g + 1) * padding; ++p) sum.component(c)[p] += factor * own.component(c)[p];
  fill(0, own);
  return energy;
}

EvaluationStatus Terms::renew_forces(const Configuration& at, std::span<const std::int32_t> moved, std::span<const std::int32_t> lost,
                                     FieldView force, double* energy) {
  if (!parts_.skip || stateful()) return forces(at, force, energy);
  const Families& families = *parts_.families;
  const int steps = coupling_reach(), reach = std::max(1, steps - 1);   // the latter of the evaluation points at a point
  const auto around = [&](GroupMarks marks, int times) {
    for (int k = 0; k < times; ++k) marks = families.around(marks);
    return marks;
  };
  GroupMarks renewed = around(families.marks_of(lost), reach);
  add(renewed, around(families.marks_of(moved), steps));
  GroupMarks only = around(renewed, reach), complete;
  if (energy) {
    complete = renewed;
    for (const auto& term : terms_)
      if (const BreakableTerm* const bonds = term->breakable()) bonds->complete(complete);
    add(only, complete);
  }
  if (2 * count(only) > body().internal().size()) return forces(at, force, energy);
  const MarkedRegion region(families, std::move(only));
  const FieldView own = work_field(force.components);
  ExactSum sum;
  std::vector<GroupEnergy> anew;
  std::int64_t bad = -1;
  for (std::size_t t = 0; t < terms_.size() && bad < 0; ++t) {
    if (energy) anew.assign(groups(), {});
    bad = terms_[t]->forces(at.moved_to(at.u()), region, {own, anew});
    if (!energy) continue;
    // The energies of the groups that are complete take the place of those that they had: the sum is bit for bit that of all forces.
    for (std::size_t g = 0; g < anew.size(); ++g)
      if (complete[g]) energies_[t][g] = anew[g];
    add_owned(energies_[t], &GroupEnergy::stored, sum);
  }
  if (energy) *energy = total_over_ranks(sum);
  for (std::size_t g = 0; g < renewed.size(); ++g)
    for (int c = 0; c < force.components && renewed[g]; ++c)
      for (std::size_t p = g * padding; p < (g + 1) * padding; ++p)
        if (marked(renewed, p)) force.component(c)[p] = own.component(c)[p];
  fill(0, own);
  return status(bad);
}

EvaluationStatus Terms::tangent(const Configuration& at, ConstFieldView w, FieldView Kw, const Region& region) {
  clear(body(), Kw);
  return each_term([&](Term& term) { return term.tangent(at, w, region, Kw); });
}

EvaluationStatus Terms::sample(const Configuration& at, PointSamples& samples) {
  begin_samples(parts_.families->body(), samples);
  return each_term([&](Term& term) {
    SampledTerm* const sampled = term.sampled();
    return sampled ? sampled->sample(at, samples) : -1;
  });
}

std::unique_ptr<VolumetricRows> Terms::volumetric_rows() const {
  AssembledTerm* const assembled = terms_.front()->assembled();
  return assembled ? assembled->make_volumetric_rows() : nullptr;
}

Terms::Assemblies& Terms::assemblies() {
  if (!assemblies_) {
    assemblies_ = std::make_unique<Assemblies>(Assemblies{BlockRows(*parts_.families), {}, parts_.families->version()});
    for (const auto& term : terms_) {
      AssembledTerm* const assembled = term->assembled();
      assemblies_->all.push_back(assembled ? assembled->make_assembly(assemblies_->rows) : std::make_unique<PointBlocks>(*term, body()));
    }
    assemblies_->steps = coupling_reach();
  }
  return *assemblies_;
}

EvaluationStatus Terms::assemble(const Configuration& at, BlockMatrix& K) {
  Assemblies& own = assemblies();
  if (own.version != parts_.families->version()) {
    for (const auto& assembly : own.all) assembly->bonds_changed();
    own.version = parts_.families->version();
  }
  if (!K.has_pattern()) make_pattern(own.rows, own.steps, K);
  fill(0, {K.values.data(), K.values.size(), 1});
  std::int64_t bad = -1;
  for (auto assembly = own.all.begin(); assembly != own.all.end() && bad < 0; ++assembly) bad = (*assembly)->add(at, K);
  return status(bad);
}

AssembledSize Terms::assembled_size() {
  const Assemblies& own = assemblies();
  const auto d = static_cast<std::size_t>(own.rows.body().dimension());
  AssembledSize size{predict_blocks(own.rows, own.steps), own.rows.size() * 12 + own.rows.bytes()};
  size.bytes += size.blocks * (d * d * sizeof(double) + sizeof(std::int32_t));
  for (const auto& assembly : own.all) size.bytes += assembly->bytes();
  return size;
}

Field Terms::shape_tensor_condition() const {
  return has_gradients() ? condition_field(*parts_.families) : parts_.families->body().make_field(1);
}

Field Terms::damage() const { return damage_field(*parts_.families); }

MaterialPoints* Terms::material_points() const noexcept { return stateful() ? &stateful()->points() : nullptr; }

void Terms::history_restored() {
  if (stateful()) stateful()->history_restored();
}

std::vector<HistoryPlace> Terms::history_points() const { return stateful() ? stateful()->history_points() : std::vector<HistoryPlace>(); }

void Terms::average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) const {
  if (stateful()) stateful()->average_state(name, components, points, to);
  else std::ranges::fill(to, 0.0);
}

const Body& Terms::body() const noexcept { return parts_.families->body(); }

bool Terms::constant_tangent() const noexcept {
  return std::ranges::all_of(terms_, [](const auto& term) { return term->constant_tangent(); });
}

bool Terms::hold_points() const noexcept {
  return std::ranges::any_of(terms_, [](const auto& term) { return !term->assembled(); });
}

EvaluationStatus Terms::tangent_of_points(const Configuration& at, ConstFieldView w, FieldView Kw) {
  fill(0, Kw);
  return each_term([&](Term& term) { return term.assembled() ? -1 : term.tangent(at, w, {}, Kw); });
}

EvaluationStatus Terms::add_stiffness_of_points(const Configuration& at, BlockMatrix& K) {
  return each_term([&](Term& term) {
    const bool symmetric = !term.driven() || term.driven()->conservative();
    return term.assembled() || !symmetric ? -1 : add_point_blocks(term, body(), at, true, K);
  });
}

bool Terms::driven(Drive drive) const noexcept {
  return std::ranges::any_of(terms_, [&](const auto& term) { return term->driven() && term->driven()->driven(drive); });
}

bool Terms::driven_by_velocity() const noexcept {
  return std::ranges::any_of(terms_, [](const auto& term) { return term->driven() && term->driven()->needs_velocity(); });
}

EvaluationStatus Terms::driven_forces(const Configuration& at, Drive drive, FieldView force, double& energy) {
  fill(0, force);
  ExactSum sum;
  std::vector<GroupEnergy> energies;
  const EvaluationStatus status = each_term([&](Term& term) {
    DrivenTerm* const driven = term.driven();
    if (!driven || !driven->driven(drive)) return std::int64_t{-1};
    energies.assign(groups(), {});
    const std::int64_t bad = driven->driven_forces(at, drive, {force, energies});
    add_owned(energies, &GroupEnergy::stored, sum);
    return bad;
  });
  energy = total_over_ranks(sum);
  return status;
}

double Terms::accept() {
  if (!stateful()) return 0;
  stateful()->points().accept();
  return stateful()->dissipates() ? total_over_ranks(std::exchange(dissipated_, {})) : 0;
}

void Terms::revert() {
  dissipated_ = {};
  if (stateful()) stateful()->points().revert();
}

ModelReport Terms::report() const {
  const Families& families = *parts_.families;
  ModelReport report;
  report.bonds = families.bonds();
  report.broken_bonds = families.cut();
  report.singular_families = families.singular();
  report.bytes = families.bytes();
  const int d = families.body().dimension();
  const double bond_bytes = static_cast<double>(report.bonds) * 8 * (d + 1);
  if (const LatticeFamilies* lattice = families.lattice()) {
    report.skips.push_back({"neighbour lists and bond vectors", "lattice: neighbours lie at fixed shifts", megabytes(bond_bytes + 4.0 * static_cast<double>(report.bonds))});
    std::size_t whole = 0;
    const auto& chunks = lattice->tiles.chunks;
    for (const LatticeChunk& chunk : chunks) whole += chunk.pattern < 0;
    report.skips.push_back({"shape tensors of whole families",
                            fmt::format("one for {} of {} chunks, {} patterns for the rest", whole, chunks.size(), lattice->patterns.size()),
                            megabytes((static_cast<double>(chunks.size()) - static_cast<double>(lattice->patterns.size())) * sizeof(LatticePattern))});
  } else {
    report.skips.push_back({"bond vectors", "recomputed from positions", megabytes(bond_bytes)});
  }
  if (d < 3 && has_gradients()) report.skips.push_back({"components outside the space", fmt::format("{}D kernels", d), fmt::format("{} of 9 gradient components", 9 - d * d)});
  if (parts_.formulation.point && !parts_.stabilization)
    report.warnings.push_back(named("zero_energy", "one gradient per point without a stabilization: motions that alternate from point to point have no energy, and waves, loads and cracks bring them; "
                                                   "stabilization = \"silling\", or in statics \"wan\""));
  if (!conservative())
    report.warnings.push_back(
        named("forces", "local force state: forces are not the derivative of the energy, moments do not balance; for comparison only"));
  for (const std::string& note : parts_.interfaces ? parts_.interfaces->notes : std::vector<std::string>()) report.notes.emplace_back("interfaces", note);
  for (const auto& term : terms_) term->report(report);
  return report;
}

}  // namespace perikit
