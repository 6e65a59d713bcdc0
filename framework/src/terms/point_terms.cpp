#include "terms/point_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

/// Points of a body that one thread takes at a time: whole groups, so that no two threads add to the energy of one.
constexpr std::size_t block_points = 128;

/// Components of up to block_points points.
template <int components>
struct alignas(64) Lanes {
  double values[static_cast<std::size_t>(components) * block_points];
};

/// to <- components of the points, the last one repeated up to a multiple of `padding`.
void gather(ConstFieldView from, std::span<const std::int32_t> points, double* to) noexcept {
  for (int c = 0; c < from.components; ++c, to += block_points) {
    const double* component = from.component(c);
    for (std::size_t k = 0; k < points.size(); ++k) to[k] = component[points[k]];
    for (std::size_t k = points.size(); k < padded(points.size()); ++k) to[k] = to[points.size() - 1];
  }
}

}  // namespace

PointTerms::PointTerms(const Body& body, std::vector<PointTermPart> parts, double last_time) : body_(body) {
  for (PointTermPart& part : parts) {
    place(std::move(part));
    Placed& placed = placed_.back();
    if (placed.part.constants_vary_in_time) renew_constants(placed, last_time);
    renew_constants(placed, 0);
  }
}

void PointTerms::place(PointTermPart part) {
  Placed placed{.part = std::move(part), .traits = {}, .points = {}, .first = {}, .positions = {}, .constants = {}};
  placed.traits = placed.part.term->traits();
  for (const std::int32_t p : body_.set(placed.part.set))
    if (body_.owns(static_cast<std::size_t>(p)) && !body_.image(static_cast<std::size_t>(p))) placed.points.push_back(p);
  std::ranges::sort(placed.points);
  const std::size_t n = placed.points.size(), stride = padded(n);
  placed.positions = Field(body_.dimension(), stride, padding);
  for (std::size_t k = 0; k < n; ++k) {
    const Point x = body_.position(static_cast<std::size_t>(placed.points[k]));
    for (int c = 0; c < body_.dimension(); ++c) placed.positions.component(c)[k] = x[static_cast<std::size_t>(c)];
    if (k == 0 || static_cast<std::size_t>(placed.points[k]) / block_points != static_cast<std::size_t>(placed.points[k - 1]) / block_points)
      placed.first.push_back(k);
  }
  placed.first.push_back(n);
  const auto count = static_cast<std::size_t>(placed.traits.constants);
  placed.constant_stride = placed.part.constants_vary_in_space ? stride + padding : 0;   // batches read up to a multiple of `padding`
  placed.constants.assign(placed.part.constants_vary_in_space ? count * placed.constant_stride : count, 0.0);
  placed_.push_back(std::move(placed));
}

void PointTerms::renew_constants(Placed& placed, double time) const {
  placed.time = time;
  if (placed.constant_stride == 0) return placed.part.constants({}, time, placed.constants.data());
  std::vector<double> one(static_cast<std::size_t>(placed.traits.constants));
  for (std::size_t k = 0; k < placed.constant_stride && !placed.points.empty(); ++k) {
    // What is read beyond the last point is admissible, too.
    if (k < placed.points.size()) placed.part.constants(body_.position(static_cast<std::size_t>(placed.points[k])), time, one.data());
    for (std::size_t c = 0; c < one.size(); ++c) placed.constants[c * placed.constant_stride + k] = one[c];
  }
}

std::int64_t PointTerms::evaluate(const Configuration& at, const std::uint8_t* only, Placed& placed, const Wanted& wanted) {
  if (placed.part.constants_vary_in_time && placed.time != at.time()) renew_constants(placed, at.time());
  const ConstFieldView u = at.u(), v = at.velocity();
  const int d = body_.dimension();
  std::atomic<std::int64_t> bad = -1;
  parallel_for(placed.first.size() - 1, [&](std::size_t b) {
    const std::size_t begin = placed.first[b];
    const std::span<const std::int32_t> points = std::span(placed.points).subspan(begin, placed.first[b + 1] - begin);
    const auto taken = [&](std::int32_t p) { return !only || marked(only, static_cast<std::size_t>(p)); };
    if (std::ranges::none_of(points, taken)) return;
    Lanes<3> x, here, velocity, direction, force, change;
    Lanes<1> energy;
    TermBatch batch{.n = static_cast<int>(points.size()),
                    .stride = block_points,
                    .time = at.time(),
                    .x = x.values,
                    .u = here.values,
                    .constants = placed.constants.data() + (placed.constant_stride > 0 ? begin : 0),
                    .constant_stride = placed.constant_stride};
    for (int c = 0; c < d; ++c) {
      double* const to = x.values + static_cast<std::size_t>(c) * block_points;
      std::copy_n(placed.positions.component(c) + begin, points.size(), to);
      std::fill(to + points.size(), to + padded(points.size()), to[points.size() - 1]);
    }
    gather(u, points, here.values);
    if (placed.traits.velocity) {
      if (v.data) gather(v, points, velocity.values);
      else std::fill_n(velocity.values, static_cast<std::size_t>(d) * block_points, 0.0);
      batch.v = velocity.values;
    }
    if (wanted.w.data) {
      gather(wanted.w, points, direction.values);
      batch.w = direction.values;
      batch.dforce = change.values;
    }
    if (wanted.force.data) batch.force = force.values;
    if (wanted.density || !wanted.energies.empty()) batch.energy = energy.values;
    const Status status = placed.part.term->evaluate(d, batch);
    if (!status.ok()) {
      // The first of all, whichever thread is faster.
      const std::int64_t mine = points[std::min(static_cast<std::size_t>(status.inadmissible), points.size() - 1)];
      for (std::int64_t seen = bad.load(); (seen < 0 || mine < seen) && !bad.compare_exchange_weak(seen, mine);) continue;
      return;
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (!taken(points[k])) continue;
      const auto p = static_cast<std::size_t>(points[k]);
      const double volume = body_.volume(p);
      for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c) {
        if (batch.force) wanted.force.component(static_cast<int>(c))[p] += volume * force.values[c * block_points + k];
        if (batch.dforce) wanted.Kw.component(static_cast<int>(c))[p] -= volume * change.values[c * block_points + k];
      }
      if (wanted.density) wanted.density[p] += energy.values[k];
      if (!wanted.energies.empty()) wanted.energies[p / padding].stored += volume * energy.values[k];
    }
  });
  return bad;
}

std::int64_t PointTerms::evaluate(const Configuration& at, const std::uint8_t* only, const Wanted& wanted) {
  std::int64_t bad = -1;
  for (auto placed = placed_.begin(); placed != placed_.end() && bad < 0; ++placed) bad = evaluate(at, only, *placed, wanted);
  return bad;
}

std::int64_t PointTerms::forces(const Configuration& at, const Region& region, const ForceSum& sum) {
  return evaluate(at, region.only(), {.force = sum.force, .energies = sum.wants_stored() ? sum.energies : std::span<GroupEnergy>()});
}

std::int64_t PointTerms::tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) {
  return evaluate(at, region.only(), {.w = w, .Kw = Kw});
}

std::int64_t PointTerms::sample(const Configuration& at, PointSamples& samples) {
  return evaluate(at, nullptr, {.density = samples.strain_energy_density.data()});
}

std::int64_t PointTerms::forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) {
  return evaluate(at, nullptr,
                  {.force = sum.force, .density = samples.strain_energy_density.data(), .energies = sum.wants_stored() ? sum.energies : std::span<GroupEnergy>()});
}

void PointTerms::report(ModelReport& report) const {
  for (const Placed& placed : placed_) {
    report.notes.emplace_back("term", fmt::format("{} on set \"{}\"", placed.part.name, placed.part.set));
    report.bytes += placed.positions.bytes() + placed.constants.size() * sizeof(double) + placed.points.size() * sizeof(std::int32_t);
  }
}

bool PointTerms::constant_tangent() const noexcept {
  return std::ranges::all_of(placed_, [](const Placed& placed) { return placed.traits.constant_tangent && !placed.part.depends_on_time(); });
}

bool PointTerms::Placed::driven(Drive drive) const noexcept {
  return (part.depends_on_time() || !traits.conservative) && traits.dissipates == (drive == Drive::loss);
}

bool PointTerms::driven(Drive drive) const noexcept {
  return std::ranges::any_of(placed_, [&](const Placed& placed) { return placed.driven(drive); });
}

std::int64_t PointTerms::driven_forces(const Configuration& at, Drive drive, const ForceSum& sum) {
  std::int64_t bad = -1;
  for (auto placed = placed_.begin(); placed != placed_.end() && bad < 0; ++placed)
    if (placed->driven(drive)) bad = evaluate(at, nullptr, *placed, {.force = sum.force, .energies = sum.energies});
  return bad;
}

bool PointTerms::conservative() const noexcept {
  return std::ranges::all_of(placed_, [](const Placed& placed) { return placed.traits.conservative; });
}

bool PointTerms::needs_velocity() const noexcept {
  return std::ranges::any_of(placed_, [](const Placed& placed) { return placed.traits.velocity; });
}

}  // namespace perikit
