#include <algorithm>

#include "maps/selective_laws.hpp"
#include "operators/batch.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

/// The first of n lanes that is not good at one of its ends, or -1.
template <class Good>
int first_bad_lane(int n, int lanes, int ends, const Good& good) noexcept {
  for (int l = 0; l < n; l += pack_width)
    for (int end = 0; end < ends; ++end) {
      const PackMask here = good(end * lanes + l);
      if (all(here)) [[likely]]
        continue;
      for (int k = 0; k < pack_width && l + k < n; ++k)
        if (!here[k]) return l + k;
    }
  return -1;
}

/// x where counted is 1, 0 where it is 0. Anything may stand there.
void keep_counted(int lanes, const double* counted, double* x) noexcept {
  for (int l = 0; l < lanes && counted; l += pack_width) select(Pack::load(counted + l) == Pack(1.0), Pack::load(x + l), Pack(0.0)).store(x + l);
}

}  // namespace

/// One law without a history at Ft.
LawBatch BatchWork::own_gradients(int n, BatchScratch& s) const noexcept {
  LawBatch batch{.n = n, .H = s.Ht, .confined = confined()};
  if (energy_ || screen_) batch.psi = s.psi;
  if (work_ == Work::tangent) batch.dH = s.dHt;
  return batch;
}

/// What the ends say of shapes is the same, and what they say of volumes are scalars.
int BatchWork::decoupled_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  const bool tangent = work_ == Work::tangent;
  LawBatch shape = own_gradients(n, s);
  (tangent ? shape.dP : shape.P) = s.P;
  if (const int bad = laws_.evaluate_isochoric(law, shape, s.law).inadmissible; bad >= 0) return bad;
  const SelectiveBatch batch{lanes, ends, s.Ht, tangent ? s.dHt : nullptr, s.owner_volumes, s.inverse, s.growth};
  mapped_volumes(laws_.space(), batch, s.volume_change);
  keep_counted(ends * lanes, counted, s.volume_change);
  if (!batch.volume.whole) keep_counted(ends * lanes, counted, s.growth);
  laws_.evaluate_volumetric(law, {.n = ends * lanes,
                                  .j = s.volume_change,
                                  .psi = shape.psi ? s.volumetric_psi : nullptr,
                                  .kirchhoff = s.kirchhoff,
                                  .slope = tangent ? s.kirchhoff_slope : nullptr});
  const int bad = first_bad_lane(n, lanes, ends, [&](int at) {
    return (Pack::load(s.volume_change + at) > Pack(-1.0)) & (Pack(0.0) * Pack::load(s.kirchhoff + at) == Pack(0.0));
  });
  if (bad >= 0) return bad;
  for (int end = ends - 1; end >= 0 && shape.psi; --end)
    for (int l = 0; l < lanes; l += pack_width) (Pack::load(s.psi + l) + Pack::load(s.volumetric_psi + end * lanes + l)).store(s.psi + end * lanes + l);
  const VolumetricStress stress{tangent ? -1.0 : 1.0, {s.weight, s.far_weight}, s.kirchhoff, tangent ? s.kirchhoff_slope : nullptr, s.P, s.pressure, s.pressure_rate};
  if (volumetric_pull_back(laws_.space(), batch, stress)) return -1;
  for (int l = 0; l < lanes; l += pack_width) {
    const Pack weight = ends == 2 ? Pack::load(s.weight + l) + Pack::load(s.far_weight + l) : Pack::load(s.weight + l);
    (Pack(stress.sign) * weight).store(s.bond_weight + l);
  }
  s.stress_weight = s.bond_weight;
  return -1;
}

/// What the ends say are multiples of P and F.
int BatchWork::green_linear_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  const bool tangent = work_ == Work::tangent;
  LawBatch own = own_gradients(n, s);
  own.P = s.P;
  if (tangent) own.dP = s.other;
  if (const int bad = laws_.evaluate_law(law, own, s.law).inadmissible; bad >= 0) return bad;
  const SelectiveBatch batch{lanes, ends, s.Ht, tangent ? s.dHt : nullptr, s.owner_volumes, s.inverse, s.growth};
  find_growths(laws_.space(), batch);
  keep_counted(ends * lanes, counted, s.growth);
  const int bad = first_bad_lane(n, lanes, ends, [&](int at) { return Pack(0.0) * Pack::load(s.growth + at) == Pack(0.0); });
  if (bad >= 0) return bad;
  const double kappa = laws_.bulk_modulus(law);
  if (own.psi) map_energies(laws_.space(), batch, kappa, s.psi);
  green_pull_back(laws_.space(), batch, kappa, {tangent ? -1.0 : 1.0, {s.weight, s.far_weight}, s.P, own.dP, s.P, s.pressure, s.pressure_rate});
  return -1;
}

/// A law of which something is known, once for both ends. counted: 1 by end where that end of that lane is to count, else 0, where Ft is I if neither of
/// its ends counts, and weights are zero; null: all.
int BatchWork::once_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept {
  const bool decoupled = laws_.growth(law) == Laws::Growth::decoupled;
  const int bad = decoupled ? decoupled_pass(n, s, ends, law, counted) : green_linear_pass(n, s, ends, law, counted);
  if (energy_ || screen_) keep_counted(ends * static_cast<int>(padded(static_cast<std::size_t>(n))), counted, s.psi);
  return bad;
}

void BatchWork::find_laws(int n, const BatchScratch& s, int ends, BondLaws& laws) const noexcept {
  LaminateLanes laminates;
  if (laminates_) find_laminates(n, s, true, laminates);
  for (int l = 0; l < n; ++l) {
    std::int32_t& law = laws.of[l] = BondLaws::no_end;
    for (int end = 0; end < ends; ++end) {
      const auto id = static_cast<std::int32_t>(laws_.id_of(static_cast<std::size_t>((end == 0 ? s.owner : s.far)[l])));
      const bool silent = laws_.records()[static_cast<std::size_t>(id)].silent;
      laws.one = laws.one && !silent;
      if (!silent) law = law == BondLaws::no_end || law == id ? id : BondLaws::each_end;
    }
    if (law >= 0 && laws_.growth(static_cast<std::size_t>(law)) == Laws::Growth::unknown) law = BondLaws::each_end;
  }
  for (int k = 0; k < laminates.n; ++k) laws.of[laminates.lane[k]] = BondLaws::each_end;
  for (int l = 0; l < n; ++l) {
    laws.any_each_end |= laws.of[l] == BondLaws::each_end;
    laws.any_once |= laws.of[l] >= 0;
    laws.one = laws.one && laws.of[l] >= 0 && laws.of[l] == laws.of[0];
  }
}

/// Lanes of several laws. What a bond gives does not depend on who shares its batch: the same bits in any part of a body.
int BatchWork::mixed_pass(int n, BatchScratch& s, int ends) const noexcept {
  struct Results {
    alignas(64) double P[9 * batch_points], psi[batch_points], pressure[batch_points], rate[batch_points];
  };
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n))), all = ends * lanes, components = gradient_components(dimension(laws_.space()));
  const bool tangent = work_ == Work::tangent;
  BondLaws laws;
  find_laws(n, s, ends, laws);
  if (laws.one) return once_pass(n, s, ends, static_cast<std::size_t>(laws.of[0]), nullptr);
  if (laws.any_each_end || !laws.any_once) {
    const int bad = mapped_pass(n, s, ends);
    if (bad >= 0 || !laws.any_once) return bad;
  }
  Results sum{};
  const auto add = [&](const auto& counts) {   // counts(lane)
    const auto row = [&](const double* from, double* to, int size) {
      for (int at = 0; at < size; ++at)
        if (at % lanes < n && counts(at % lanes)) to[at] = from[at];
    };
    for (int c = 0; c < components; ++c) row(s.P + c * batch_points, sum.P + c * batch_points, lanes);
    if (energy_ || screen_) row(s.psi, sum.psi, all);
    row(s.pressure, sum.pressure, all);
    if (tangent) row(s.pressure_rate, sum.rate, all);
  };
  if (laws.any_each_end) add([&](int l) { return laws.of[l] == BondLaws::each_end; });
  // Gradients and weights as they came.
  const std::size_t size = static_cast<std::size_t>(components) * batch_points;
  std::copy_n(s.Ht, size, s.H);
  if (tangent) std::copy_n(s.dHt, size, s.dH);
  alignas(64) double weight[2][batch_points], counted[batch_points];
  std::copy_n(s.weight, lanes, weight[0]);
  std::copy_n(s.far_weight, lanes, weight[1]);
  for (std::int32_t id = 0; id < static_cast<std::int32_t>(laws_.records().size()); ++id) {
    const auto mine = [&](int l) { return l < n && laws.of[l] == id; };
    bool present = false;
    for (int l = 0; l < n; ++l) present |= mine(l);
    if (!present) continue;
    for (int l = 0; l < lanes; ++l) {
      for (int c = 0; c < components; ++c) {
        s.Ht[c * batch_points + l] = mine(l) ? s.H[c * batch_points + l] : 0.0;
        if (tangent) s.dHt[c * batch_points + l] = mine(l) ? s.dH[c * batch_points + l] : 0.0;
      }
      for (int end = 0; end < ends; ++end) {
        const bool counts = mine(l) && !laws_.record_of(static_cast<std::size_t>((end == 0 ? s.owner : s.far)[l])).silent;
        counted[end * lanes + l] = counts ? 1.0 : 0.0;
        (end == 0 ? s.weight : s.far_weight)[l] = counts ? weight[end][l] : 0.0;
      }
    }
    s.stress_weight = nullptr;
    if (const int bad = once_pass(n, s, ends, static_cast<std::size_t>(id), counted); bad >= 0) return bad;
    weigh_stress(n, s);
    add(mine);
  }
  for (int c = 0; c < components; ++c) std::copy_n(sum.P + c * batch_points, lanes, s.P + c * batch_points);
  std::copy_n(sum.psi, all, s.psi);
  std::copy_n(sum.pressure, all, s.pressure);
  std::copy_n(sum.rate, all, s.pressure_rate);
  std::copy_n(weight[0], lanes, s.weight);
  std::copy_n(weight[1], lanes, s.far_weight);
  s.stress_weight = nullptr;
  return -1;
}

int BatchWork::selective_pass(int n, BatchScratch& s, int ends, GroupEnergy* energy) const noexcept {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  if (dissipates()) std::fill_n(s.dissipated, ends * lanes, 0.0);   // laws with a history do
  const auto pass = [&] {
    if (work_ == Work::sample) return mapped_pass(n, s, ends);
    if (!one_law(s) || (s.one_law < 0 && laminates_)) return mixed_pass(n, s, ends);
    const std::size_t law = s.one_law >= 0 ? static_cast<std::size_t>(s.one_law) : 0;
    return laws_.growth(law) == Laws::Growth::unknown ? mapped_pass(n, s, ends) : once_pass(n, s, ends, law, nullptr);
  };
  if (const int bad = pass(); bad >= 0) return bad;
  if (screen_) std::copy_n(s.psi, ends * lanes, s.highest);
  for (int end = 0; end < ends; ++end) add_energies(n, end == 0 ? s.weight : s.far_weight, s, end * lanes, energy);
  return -1;
}

/// The law at what is mapped for each end.
int BatchWork::mapped_pass(int n, BatchScratch& s, int ends) const noexcept {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  const bool tangent = work_ == Work::tangent;
  const SelectiveBatch batch{lanes, ends, s.Ht, tangent ? s.dHt : nullptr, s.owner_volumes, s.inverse, s.growth};
  selective_map(laws_.space(), batch, s.H, s.dH);
  double* const rate = tangent ? s.other : nullptr;
  const bool one_law = this->one_law(s);
  if (ends == 2 && !one_law) std::copy_n(s.far, lanes, s.owner + lanes);
  if (ends == 2 && wants_ends()) {
    std::copy_n(s.far, lanes, s.owner + lanes);
    std::copy_n(s.owner, lanes, s.far + lanes);
  }
  if (ends == 2 && points_) {
    for (int l = 0; l < lanes; ++l) {
      if (s.first_number >= 0) s.number[l] = s.first_number + l;
      s.number[lanes + l] = s.number[l] < 0 ? -1 : s.number[l] + s.far_number;
    }
    s.first_number = -1;
  }
  int bad = evaluate_laws((ends - 1) * lanes + n, s, one_law ? nullptr : s.owner, 0, s.P, rate);
  if (bad >= 0) return bad % lanes;
  for (int end = 0; end < ends && limits_step(s); ++end) ask_for_steps(end * lanes, n, end == 0 ? s.weight : s.far_weight, s, 0);
  if (laminates_ && s.one_law < 0) {
    // What is mapped for either end is a laminate of its own: their owners' volumes differ.
    LaminateLanes laminates;
    find_laminates(n, s, true, laminates);
    repeat_for_ends(lanes, s, ends, laminates);
    if (laminates.n > 0) bad = evaluate_laminates(s, s.P, rate, laminates);
    if (bad >= 0) return bad % lanes;
  }
  if (!one_law) {
    // Only points that store nothing pass laws with a volume turned over: families at the rim of images are poor, and nobody asks for them.
    const auto tidy = [](double* x, int lanes_of) {
      for (int l = 0; l < lanes_of; l += pack_width) {
        const Pack value = Pack::load(x + l);
        select(value == value, value, Pack(0.0)).store(x + l);
      }
    };
    tidy(s.growth, ends * lanes);
    tidy(s.inverse, lanes);
  }
  if (work_ == Work::sample && !pulled_back_) return -1;
  selective_pull_back(laws_.space(), batch, {tangent ? -1.0 : 1.0, {s.weight, s.far_weight}, s.P, tangent ? s.other : nullptr, s.P, s.pressure, s.pressure_rate});
  return -1;
}

}  // namespace perikit
