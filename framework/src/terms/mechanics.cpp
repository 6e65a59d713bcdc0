#include "terms/mechanics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "assembly/bond_assembly.hpp"
#include "assembly/element_assembly.hpp"
#include "core/dimension.hpp"
#include "core/per_thread.hpp"
#include "spaces/evaluation_points.hpp"
#include "spaces/find_laminates.hpp"

namespace perikit {

Mechanics::Mechanics(const SpaceParts& parts) : parts_(parts) {
  space_ = with_dimension(parts.families.body().dimension(), [&](auto d) { return make_space<d>(parts_); });
  if (parts_.interfaces) {
    laminates_ = std::make_unique<Laminates>(parts_.interfaces, parts.families.body().stride(), space_->numbers());
    find_laminates(laminates_->near(), false);
  }
  points_ = std::make_unique<MaterialPoints>(parts_.laws, space_->numbers());
}

void Mechanics::balance(std::shared_ptr<CloudConsistency> consistency) {
  if (!consistency->found) find_consistency(parts_, *space_, *consistency);
  consistency_ = std::move(consistency);
  parts_.factors = consistency_->factors;
  space_->set_factors(parts_.factors);
  if (consistency_->shift.components() == 0) return;
  parts_.shift = consistency_->shift;
  space_->shift_gradients(parts_.shift);
  if (laminates_) find_laminates(laminates_->near(), true);
}

BatchWork Mechanics::work(const Configuration& at, BatchTask task) const noexcept {
  task.selective = parts_.formulation.selective();
  task.points = points_.get();
  task.time_step = at.time_step();
  task.external = at.external();
  task.ends_step = at.ends_step();
  task.laminates = laminates_.get();
  return {parts_.laws, task};
}

void Mechanics::bonds_changed(std::span<const std::int32_t> points) {
  space_->bonds_changed(points);
  if (!laminates_) return;
  // Gradients at the far ends of bonds change as well.
  GroupMarks marks(parts_.families.body().stride() / padding, 0);
  parts_.families.mark(points, marks);
  find_laminates(std::move(marks), true);
}

std::vector<HistoryPlace> Mechanics::history_points() {
  return with_dimension(parts_.families.body().dimension(), [&](auto d) { return history_points<d>(); });
}

template <int D>
std::vector<HistoryPlace> Mechanics::history_points() {
  const Body& body = parts_.families.body();
  const auto place = [&](std::int32_t p) -> std::int64_t { return body.part() ? body.places().place[static_cast<std::size_t>(p)] : p; };
  PerThread<EvaluationPoints<D>> readers;
  readers.prepare([&] { return std::make_unique<EvaluationPoints<D>>(parts_); });
  const auto add_points = [&](std::int32_t p, std::vector<HistoryPlace>& to) {
    const auto at = static_cast<std::size_t>(p);
    if (!space_->evaluates(at)) return;
    EvaluationPoints<D>& points = readers.mine();
    const bool own = body.owns(at), of_bonds = points.at_bonds();
    if (of_bonds) points.read(at);
    for (int q = 0; q < points.points(); ++q) {
      const std::int32_t far = points.far(q);
      // Parts of families that have become too poor for a gradient have no weight, until so many bonds have failed that one of them is all
      // that its point has. Their history goes on meanwhile.
      if (of_bonds && (points.weight(q) == 0 || (parts_.bonds_once() && far < p))) continue;
      const std::int64_t state = space_->number_of(p, far, q).state;
      if (state < 0) continue;
      to.push_back({{place(p), of_bonds ? place(far) : -1, of_bonds ? 0 : q}, state, own});
      // Two states of bonds between unlike laws alone, and never of those that store nothing here: a body of one law has other laws on ranks, of
      // their ghosts, and yet the same evaluation points.
      const auto incomplete = [&](std::int32_t end) { return parts_.laws.has_incomplete_points() && parts_.laws.incomplete(static_cast<std::size_t>(end)); };
      if (!of_bonds || !parts_.bonds_once() || (!parts_.formulation.selective() && (incomplete(p) || incomplete(far)))) continue;
      if (const std::int64_t of_far = space_->number_of(far, p, 0).state; of_far != state) to.push_back({{place(p), place(far), 1}, of_far, own});
    }
  };
  std::vector<HistoryPlace> all;
  constexpr std::size_t at_once = 8192;   // points, so that what is found of them takes little memory
  std::vector<std::vector<HistoryPlace>> found(at_once);
  const std::span<const std::int32_t> points = body.internal();
  for (std::size_t first = 0; first < points.size(); first += at_once) {
    const std::size_t count = std::min(at_once, points.size() - first);
    parallel_for(count, [&](std::size_t k) {
      found[k].clear();
      add_points(points[first + k], found[k]);
    });
    for (std::size_t k = 0; k < count; ++k) all.insert(all.end(), found[k].begin(), found[k].end());
  }
  std::ranges::sort(all, {}, &HistoryPlace::point);
  return all;
}

void Mechanics::average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) {
  with_dimension(parts_.families.body().dimension(), [&](auto d) { average_state<d>(name, components, points, to); });
}

template <int D>
void Mechanics::average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) const {
  constexpr std::size_t nowhere = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> first;   // of the variable among the components of each law
  for (const MaterialRecord& record : parts_.laws.records()) {
    std::size_t at = 0, found = nowhere;
    for (const StateVariable& variable : record.material->state(parts_.laws.space())) {
      if (variable.name == name) found = at;
      at += static_cast<std::size_t>(variable.components);
    }
    first.push_back(found);
  }
  std::ranges::fill(to, 0.0);
  PerThread<EvaluationPoints<D>> readers;
  readers.prepare([&] { return std::make_unique<EvaluationPoints<D>>(parts_); });
  parallel_for(points.size(), [&](std::size_t k) {
    const auto p = static_cast<std::size_t>(points[k]);
    const std::size_t offset = first[parts_.laws.id_of(p)];
    if (offset == nowhere || !space_->evaluates(p)) return;
    const std::span<double> sum = to.subspan(k * components, components);
    double total = 0;
    over_states<D>(points[k], readers.mine(), [&](int, double weight, std::int64_t number) {
      total += weight;
      for (std::size_t c = 0; c < components; ++c) sum[c] += weight * points_->begin()[(offset + c) * points_->stride() + static_cast<std::size_t>(number)];
    });
    for (std::size_t c = 0; c < components && total != 0; ++c) sum[c] /= total;
  });
}

template <int D, class Visit>
void Mechanics::over_states(std::int32_t p, EvaluationPoints<D>& reader, Visit&& visit) const {
  const auto at = [&](double weight, std::int32_t far, int part) {
    if (const std::int64_t number = weight == 0 ? -1 : space_->number_of(p, far, part).state; number >= 0) visit(part, weight, number);
  };
  if (!reader.at_bonds() && reader.points() == 1) return at(1, -1, 0);
  reader.read(static_cast<std::size_t>(p));
  for (int q = 0; q < reader.points(); ++q) at(reader.weight(q), reader.far(q), q);
}

/// Of several points with the same wish the first in the order of the input.
template <int D>
StatefulTerm::ShorterStep Mechanics::shortest(std::vector<MaterialPoints::TooLong> asked) const {
  const Body& body = parts_.families.body();
  EvaluationPoints<D> reader(parts_);
  ShorterStep found;
  std::ranges::sort(asked, {}, &MaterialPoints::TooLong::number);
  // Evaluation points without a gradient fall to H = 0 when their bonds fail: no step is too long for that. Those of bond shapes have no weight then.
  const auto deforms = [&](std::size_t p, int q) {
    if (parts_.formulation.bond) return true;
    reader.read(p);
    const double* const g = reader.gradient(q);
    return std::any_of(g, g + reader.bonds() * D, [](double component) { return component != 0; });
  };
  for (const std::int32_t p : body.internal()) {
    const auto at = static_cast<std::size_t>(p);
    if (!body.owns(at) || !space_->evaluates(at)) continue;
    over_states<D>(p, reader, [&](int q, double, std::int64_t number) {
      const auto of_q = std::ranges::lower_bound(asked, number, {}, &MaterialPoints::TooLong::number);
      if (of_q == asked.end() || of_q->number != number || (of_q->at_rest && !deforms(at, q))) return;
      const bool first = found.point < 0 || body.number(at) < body.number(static_cast<std::size_t>(found.point));
      if (of_q->factor < found.factor || (of_q->factor == found.factor && first)) found = {of_q->factor, p};
    });
  }
  return found;
}

StatefulTerm::ShorterStep Mechanics::shorter_step() { return shorter_; }

void Mechanics::find_laminates(GroupMarks marks, bool again) {
  for (std::size_t g = 0; g < marks.size(); ++g) marks[g] &= laminates_->near()[g];
  if (std::ranges::all_of(marks, [](std::uint8_t group) { return group == 0; })) return;
  const std::size_t parallel = with_dimension(parts_.families.body().dimension(), [&](auto d) {
    return perikit::find_laminates<d>(parts_, *space_, marks, *laminates_);
  });
  if (!again) laminates_->kept_parallel += parallel;
}

std::int64_t Mechanics::add_forces(const Configuration& at, const Region& region, const ForceSum& sum, const SampleSums* samples) {
  BatchWork work = this->work(at, {.work = Work::force, .energy = sum.wants_stored(), .screen = sum.screen});
  if (samples) work.sample_along(*samples);
  Pass pass{work, at.unfinished(), {}, sum.force, nullptr, sum.energies.empty() ? nullptr : sum.energies.data(), -1, {}, region.only(), region.near()};
  pass.arrival = at.arrival();
  pass.motion = at.motion();
  if (pass.motion && !space_->moves_points()) pass.motion->finish();
  space_->run(pass);
  std::vector<MaterialPoints::TooLong> too_long = points_->take_too_long();
  shorter_ = {};
  if (pass.bad >= 0) return pass.bad;
  if (!too_long.empty()) shorter_ = with_dimension(parts_.families.body().dimension(), [&](auto d) { return shortest<d>(std::move(too_long)); });
  if (at.ends_step() && region.whole() && shorter_.point < 0) points_->step_ended();
  return -1;
}

std::int64_t Mechanics::tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) {
  const BatchWork work = this->work(at, {.work = Work::tangent});
  Pass pass{work, at.u(), w, Kw, nullptr, nullptr, -1, {}, region.only(), region.near()};
  space_->run(pass);
  return pass.bad;
}

void Mechanics::add_bonds(const Configuration& at, const Region& region, BondSamples& samples) {
  BatchWork work = this->work(at, {.work = Work::sample});
  if (samples.what() == BondSampling::derivative) work.pull_back();
  Pass pass{work, at.u(), {}, {}, nullptr, nullptr, -1, {}, region.only(), region.near(), &samples};
  space_->run(pass);
}

namespace {

/// Weighted sums of what evaluation points hold -> averages at the points that they belong to.
class Averages {
 public:
  /// Makes the fields that `samples` asks for.
  Averages(const Body& body, const Laws& laws, PointSamples& samples) : body_(body), samples_(samples), energy_(body.make_field(1)) {
    const auto field = [&](Sampling of, int components) { return any_of(samples.asked, of) ? body.make_field(components) : Field(); };
    weight_ = field(Sampling::H | Sampling::P | Sampling::cauchy | Sampling::von_mises, 1);
    samples.H = field(Sampling::H, laws.components());
    samples.P = field(Sampling::P, laws.components());
    samples.cauchy = field(Sampling::cauchy, 9);
    samples.von_mises = field(Sampling::von_mises, 1);
  }
  SampleSums sums() {
    const auto to = [](Field& of) { return of.size() > 0 ? of.data() : nullptr; };
    return {to(weight_), energy_.data(), to(samples_.H), to(samples_.P), to(samples_.cauchy), to(samples_.von_mises), body_.stride()};
  }
  void finish() {
    const bool averages = weight_.size() > 0;
    for (const std::int32_t index : body_.internal()) {
      const auto p = static_cast<std::size_t>(index);
      samples_.strain_energy_density.data()[p] += energy_.data()[p] / body_.volume(p);
      if (!averages) continue;
      const double inverse = weight_.data()[p] > 0 ? 1.0 / weight_.data()[p] : 0.0;
      for (Field* field : {&samples_.H, &samples_.P, &samples_.cauchy, &samples_.von_mises})
        for (int c = 0; c < field->components(); ++c) field->component(c)[p] *= inverse;
    }
  }

 private:
  const Body& body_;
  PointSamples& samples_;
  Field weight_, energy_;
};

}  // namespace

std::int64_t Mechanics::sample(const Configuration& at, PointSamples& samples) {
  Averages averages(parts_.families.body(), parts_.laws, samples);
  const SampleSums sums = averages.sums();
  const BatchWork work = this->work(at, {.work = Work::sample});
  Pass pass{work, at.u(), {}, {}, &sums, nullptr, -1, {}};
  space_->run(pass);
  averages.finish();
  return pass.bad;
}

std::int64_t Mechanics::forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) {
  if (!space_->samples_along() || parts_.numbered()) {
    const std::int64_t bad = forces(at, {}, sum);
    return bad < 0 ? sample(at, samples) : bad;
  }
  Averages averages(parts_.families.body(), parts_.laws, samples);
  const SampleSums sums = averages.sums();
  const std::int64_t bad = add_forces(at, {}, sum, &sums);
  averages.finish();
  return bad;
}

int Mechanics::coupling_reach() const noexcept {
  return parts_.formulation.bond && parts_.formulation.far_share > 0 ? 3 : 2;
}

std::unique_ptr<Assembly> Mechanics::make_assembly(const BlockRows& rows) {
  const LawsOfSpace laws{*points_, *space_, laminates_.get()};
  return with_dimension(parts_.families.body().dimension(), [&](auto d) -> std::unique_ptr<Assembly> {
    if (parts_.formulation.bond) return std::make_unique<BondAssembly<d>>(parts_, laws, rows);
    return std::make_unique<ElementAssembly<d>>(parts_, laws, rows);
  });
}

std::unique_ptr<VolumetricRows> Mechanics::make_volumetric_rows() {
  const Formulation& f = parts_.formulation;
  if (!f.selective() || f.force_state != ForceState::variational) return nullptr;
  return perikit::make_volumetric_rows(parts_, {*points_, *space_, laminates_.get()});
}

void Mechanics::report(ModelReport& report) const {
  space_->report(report);
  report.resting += space_->resting_counts();
  report.bytes += points_->bytes();
  if (consistency_) consistency_->report(report);
  if (!laminates_) return;
  report.bytes += laminates_->bytes();
  report.notes.emplace_back("interfaces", fmt::format("{} evaluation points are laminates of two materials{}", laminates_->count(),
                                                      laminates_->kept_parallel == 0 ? std::string()
                                                                                     : fmt::format("; {} that see corners, thin layers or more than two materials "
                                                                                                   "take each law by its share of the weight",
                                                                                                   laminates_->kept_parallel)));
}

}  // namespace perikit
