#include "terms/mechanics.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "assembly/bond_assembly.hpp"
#include "assembly/element_assembly.hpp"
#include "core/dimension.hpp"

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

/// Of the rows of these displacements, where those of the first `keep` components are not zero.
std::vector<LaminateFinder::Found> Mechanics::gradients_of(const Field& values, int keep, const GroupMarks& marks, const GroupMarks& near,
                                                        bool with_weightless) {
  LaminateFinder finder(parts_.families.body().dimension(), parts_.formulation.pair_symmetric && parts_.share, keep, with_weightless);
  const BatchWork work(parts_.laws, {.work = Work::sample, .selective = parts_.formulation.selective(), .finder = &finder});
  Pass pass{work, values, {}, {}, nullptr, nullptr, -1, {}, marks.data(), near.data()};
  space_->run(pass);
  return finder.take();
}

std::vector<HistoryPlace> Mechanics::history_points() {
  constexpr std::size_t at_once = 1024;  // groups, so that what is found of them takes little memory
  const Body& body = parts_.families.body();
  const Field values = body.make_field(body.dimension());
  const auto place = [&](std::int32_t p) -> std::int64_t {
    return !body.part() || p < 0 ? p : body.places().place[static_cast<std::size_t>(p)];
  };
  // Those of points and of parts of families have no far end.
  const bool of_bonds = parts_.formulation.bond || (parts_.formulation.weighted && parts_.formulation.parts(body.dimension()) == 0);
  // Of bonds between unlike laws alone, and never of those that store nothing here: a body of one law has other laws on ranks, of their ghosts, and yet
  // the same evaluation points.
  const auto two_states = [&](const LaminateFinder::Found& found) {
    const auto owner = static_cast<std::size_t>(found.owner), far = static_cast<std::size_t>(found.far);
    if (parts_.formulation.selective()) return true;
    return !parts_.laws.same(owner, far) && !(parts_.laws.has_incomplete_points() && (parts_.laws.incomplete(owner) || parts_.laws.incomplete(far)));
  };
  std::vector<HistoryPlace> points;
  const std::size_t groups = body.stride() / padding;
  for (std::size_t first = 0; first < groups; first += at_once) {
    GroupMarks marks(groups, 0);
    std::fill_n(marks.begin() + static_cast<std::ptrdiff_t>(first), std::min(at_once, groups - first), whole_group);
    const GroupMarks near = parts_.families.around(marks);
    // Parts of families that have become too poor for a gradient have no weight, until so many bonds have failed that one of them is all
    // that its point has. Their history goes on meanwhile.
    for (const LaminateFinder::Found& found : gradients_of(values, 0, marks, near, !of_bonds && parts_.formulation.weighted != nullptr)) {
      const bool own = body.owns(static_cast<std::size_t>(found.owner));
      const HistoryPoint point{place(found.owner), of_bonds ? place(found.far) : -1,
                               of_bonds ? std::int64_t{0} : space_->which(found.number)};
      points.push_back({point, found.number, own});
      if (found.other_number >= 0 && two_states(found)) points.push_back({{point.owner, point.far, point.which + 1}, found.other_number, own});
    }
  }
  std::ranges::sort(points, {}, &HistoryPlace::point);
  return points;
}

void Mechanics::find_laminates(GroupMarks marks, bool again) {
  const Body& body = parts_.families.body();
  const Interfaces& interfaces = laminates_->interfaces();
  const int d = body.dimension();
  bool any = false;
  for (std::size_t g = 0; g < marks.size(); ++g) {
    marks[g] &= laminates_->near()[g];
    any |= marks[g] != 0;
  }
  if (!any) return;
  const GroupMarks near = parts_.families.around(marks);
  Field values = body.make_field(d);
  if (again)
    for (const LaminateFinder::Found& found : gradients_of(values, 0, marks, near)) laminates_->clear(found.number);
  // The gradients of the three values, as many of them at once as there are components.
  for (std::size_t k = 0; k < interfaces.all.size(); ++k) {
    std::vector<LaminateFinder::Found> of_value[interface_values];
    for (int first = 0; first < interface_values; first += d) {
      const int count = std::min(d, interface_values - first);
      for (int c = 0; c < d; ++c) {
        double* const to = values.component(c);
        std::fill_n(to, body.stride(), 0.0);
        for (const std::int32_t index : body.internal())
          if (const auto p = static_cast<std::size_t>(index); c < count) to[p] = interface_value(interfaces, k, p, static_cast<InterfaceValue>(first + c));
      }
      // Both parts of the distance, where they come together.
      const std::vector<LaminateFinder::Found> found = gradients_of(values, first == 0 ? std::min(count, 2) : 1, marks, near);
      for (int c = 0; c < count; ++c) {
        std::vector<LaminateFinder::Found>& to = of_value[first + c];
        to = found;
        for (LaminateFinder::Found& entry : to) std::copy_n(entry.gradient[c], 3, entry.gradient[0]);
      }
    }
    const auto other = [&](InterfaceValue what, std::int64_t number) -> const double* {
      const auto& all = of_value[static_cast<int>(what)];
      const auto at = std::ranges::lower_bound(all, number, {}, &LaminateFinder::Found::number);
      return at != all.end() && at->number == number ? at->gradient[0] : nullptr;
    };
    for (const LaminateFinder::Found& found : of_value[0]) {
      const double* const minus = other(InterfaceValue::minus, found.number);
      if (!minus || !sees(d, minus)) continue;
      double gradient[interface_values][3] = {};
      std::copy_n(found.gradient[0], 3, gradient[0]);
      std::copy_n(minus, 3, gradient[1]);
      if (const double* others = other(InterfaceValue::others, found.number)) std::copy_n(others, 3, gradient[2]);
      LaminatePoint point;
      if (!find_laminate(d, gradient, point)) {
        laminates_->kept_parallel += !again;
        continue;
      }
      set_points(interfaces, k, found.owner, point);
      laminates_->set(found.number, point);
    }
  }
}

std::int64_t Mechanics::add_forces(const Configuration& at, const Region& region, const ForceSum& sum, const SampleSums* samples) {
  BatchWork work = this->work(at, {.work = Work::force, .energy = sum.wants_stored(), .screen = region.whole() ? screen_ : nullptr});
  if (samples) work.sample_along(*samples);
  Pass pass{work, at.unfinished(), {}, sum.force, nullptr, sum.energies.empty() ? nullptr : sum.energies.data(), -1, {}, region.only(), region.near()};
  pass.arrival = at.arrival();
  pass.motion = at.motion();
  if (pass.motion && !space_->moves_points()) pass.motion->finish();
  space_->run(pass);
  if (at.ends_step() && region.whole() && pass.bad < 0) points_->step_ended();
  return pass.bad;
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
  const RememberedPoints remembered{*points_, [this](const BlockRows& of) { return numbers_by_row(of); }};
  return with_dimension(parts_.families.body().dimension(), [&](auto d) -> std::unique_ptr<Assembly> {
    if (parts_.formulation.bond) return std::make_unique<BondAssembly<d>>(parts_, remembered, rows);
    return std::make_unique<ElementAssembly<d>>(parts_, remembered, rows);
  });
}

std::vector<std::int64_t> Mechanics::numbers_by_row(const BlockRows& rows) {
  const std::vector<HistoryPlace> known = history_points();   // assembled tangents have the whole body: places are indices
  const auto number_of = [&](const HistoryPoint& point) {
    const auto at = std::ranges::lower_bound(known, point, {}, &HistoryPlace::point);
    return at != known.end() && at->point == point ? at->number : std::int64_t{-1};
  };
  const auto parts = static_cast<std::size_t>(parts_.formulation.parts(rows.body().dimension()));
  std::vector<std::int64_t> numbers;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto p = static_cast<std::int64_t>(rows.point(r));
    for (std::size_t w = 0; w < parts; ++w) numbers.push_back(number_of({p, -1, static_cast<std::int64_t>(w)}));
    if (parts > 0) continue;
    for (const std::int32_t neighbour : rows.neighbours(r)) {
      // A bond that is evaluated once for both ends has one state, or a second one for the end that does not have its number.
      const auto q = static_cast<std::int64_t>(rows.point(static_cast<std::size_t>(neighbour)));
      std::int64_t number = number_of({p, q, 0});
      if (number < 0) number = number_of({q, p, 1});
      numbers.push_back(number >= 0 ? number : number_of({q, p, 0}));
    }
  }
  return numbers;
}

std::int64_t Mechanics::stiffness_near_laminates(ConstFieldView u, FieldView stiffness) {
  const Body& body = parts_.families.body();
  const GroupMarks& marks = laminates_->near();
  const GroupMarks near = parts_.families.around(marks);
  Field sums = body.make_field(1);
  const SampleSums to{.weight = nullptr, .psi = sums.data(), .H = nullptr, .P = nullptr, .cauchy = nullptr, .von_mises = nullptr, .stride = body.stride()};
  BatchWork work = this->work({u, 0}, {.work = Work::sample});
  work.sample_volume_stiffness();
  Pass pass{work, u, {}, {}, &to, nullptr, -1, {}, marks.data(), near.data()};
  space_->run(pass);
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const double share = parts_.families.remaining_influence(p);
    if (laminates_->near(index) && stiffness.data[p] > 0) stiffness.data[p] = share * share * sums.data()[p];
  }
  return pass.bad;
}

/// Rows whose points near interfaces have the stiffness of their laminates in place of that of one law. Of two materials in layers the softer one
/// takes most of a change of volume: a stiffness that is too large would leave the rest of the tangent indefinite.
class Mechanics::LaminateVolumes final : public VolumetricRows {
 public:
  LaminateVolumes(Mechanics& mechanics, std::unique_ptr<VolumetricRows> rows)
      : mechanics_(mechanics), rows_(std::move(rows)), stiffness_(mechanics.parts_.families.body().make_field(1)) {}

  std::int64_t linearise(ConstFieldView u) override {
    const std::int64_t bad = rows_->linearise(u);
    if (bad >= 0) return bad;
    const ConstFieldView of_one_law = rows_->stiffness();
    std::copy_n(of_one_law.data, of_one_law.size(), stiffness_.data());
    return mechanics_.stiffness_near_laminates(u, stiffness_);
  }
  void rates(ConstFieldView w, FieldView q) const override { rows_->rates(w, q); }
  void forces(ConstFieldView q, FieldView f) const override { rows_->forces(q, f); }
  void squares(ConstFieldView c, FieldView q) const override { rows_->squares(c, q); }
  ConstFieldView logarithms() const override { return rows_->logarithms(); }
  ConstFieldView stiffness() const override { return stiffness_; }

 private:
  Mechanics& mechanics_;
  std::unique_ptr<VolumetricRows> rows_;
  Field stiffness_;
};

std::unique_ptr<VolumetricRows> Mechanics::make_volumetric_rows() {
  const Formulation& f = parts_.formulation;
  if (!f.selective() || f.force_state != ForceState::variational) return nullptr;
  std::unique_ptr<VolumetricRows> rows = perikit::make_volumetric_rows(parts_);
  if (laminates_) rows = std::make_unique<LaminateVolumes>(*this, std::move(rows));
  return rows;
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
