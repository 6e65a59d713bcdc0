#include "operators/batch.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <type_traits>

#include "operators/bond_samples.hpp"
#include "operators/lane_stresses.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

void ScratchPool::prepare(const Laws& laws, bool laminates) {
  while (scratch_.size() < static_cast<std::size_t>(thread_count())) {
    // Value-initialised: components that no kernel writes (lateral H) stay zero.
    scratch_.push_back(std::make_unique<BatchScratch>());
    BatchScratch& s = *scratch_.back();
    laws.prepare(s.law, false);
    for (auto* state : {&s.old_state, &s.new_state}) state->assign(static_cast<std::size_t>(laws.state_components()) * batch_points, 0.0);
  }
  for (const auto& scratch : scratch_)  // some may have been made before there were laminates
    if (laminates && !scratch->laminate) scratch->laminate = std::make_unique<LaminateScratch>(laws);
}

// Numbers that follow each other are read and written where they lie; others, and those of bodies with several laws, are gathered.
LawState BatchWork::begin_state(int n, BatchScratch& s, std::int64_t numbers) const noexcept {
  const bool keep = keeps_history(s);
  if (s.first_number >= 0 && laws_.records().size() == 1) {
    const std::int64_t first = s.first_number + numbers;
    return {points_->begin() + first, keep ? points_->end() + first : nullptr, points_->stride(), time_step_};
  }
  for (std::size_t c = 0; c < points_->components(); ++c)
    for (int l = 0; l < static_cast<int>(padded(static_cast<std::size_t>(n))); ++l) {
      const std::int64_t q = l >= n ? -1 : s.first_number >= 0 ? s.first_number + l : s.number[l];
      s.old_state[c * batch_points + static_cast<std::size_t>(l)] = q < 0 ? 0.0 : points_->begin()[c * points_->stride() + static_cast<std::size_t>(q + numbers)];
    }
  if (keep) std::fill(s.new_state.begin(), s.new_state.end(), 0.0);   // laws without a history leave theirs alone
  return {s.old_state.data(), keep ? s.new_state.data() : nullptr, batch_points, time_step_};
}

void BatchWork::end_state(int n, BatchScratch& s, std::int64_t numbers) const noexcept {
  if (!keeps_history(s) || (s.first_number >= 0 && laws_.records().size() == 1)) return;
  for (std::size_t c = 0; c < points_->components(); ++c)
    for (int l = 0; l < n; ++l) {
      const std::int64_t q = s.first_number >= 0 ? s.first_number + l : s.number[l];
      if (q >= 0) points_->end()[c * points_->stride() + static_cast<std::size_t>(q + numbers)] = s.new_state[c * batch_points + static_cast<std::size_t>(l)];
    }
}

void BatchWork::ask_for_steps(int first, int n, const double* weight, const BatchScratch& s, std::int64_t numbers) const {
  for (int l = 0; l < n; ++l) {
    if (!(s.step_factor[first + l] < 1) || weight[l] == 0) continue;
    const std::int64_t q = s.first_number >= 0 ? s.first_number + first + l : s.number[first + l];
    bool at_rest = true;
    for (int c = 0; c < laws_.components(); ++c) at_rest = at_rest && s.H[c * batch_points + first + l] == 0;
    if (q >= 0) points_->ask_for({q + numbers, s.step_factor[first + l], at_rest});
  }
}

int BatchWork::evaluate_laws(int n, BatchScratch& s, const std::int32_t* points, std::int64_t numbers, double* P, double* dP) const noexcept {
  LawBatch batch;
  batch.n = n;
  batch.H = s.H;
  batch.confined = confined() && !selective_;
  batch.points = points;
  if (energy_ || screen_ || samples()) batch.psi = s.psi;
  batch.P = P;
  if (dP) batch.dH = s.dH;
  batch.dP = dP;
  if (samples()) batch.lateral = s.lateral;
  if (dissipates()) batch.dissipated = s.dissipated;
  if (wants_ends()) batch.external = {external_, s.owner, s.far};
  if (limits_step(s)) batch.step_factor = s.step_factor;
  if (points_) batch.state = begin_state(n, s, numbers);
  const int bad = (s.one_law >= 0 ? laws_.evaluate_law(static_cast<std::size_t>(s.one_law), batch, s.law) : laws_.evaluate(batch, s.law)).inadmissible;
  if (points_ && bad < 0) end_state(n, s, numbers);
  if (screen_)
    for (int l = 0; l < n; ++l) s.highest[l] = std::max(s.highest[l], s.psi[l]);
  return bad;
}

namespace {

/// sum of W psi, in four sums, which do not wait for each other.
double weighted_energy(int n, const double* weight, const double* psi) noexcept {
  EightSums sums[4];
  const auto add = [&](int eight, EightSums& to) {
    for (int l = eight; l < eight + 8; l += pack_width) to.at(l) += Pack::load(weight + l) * Pack::load(psi + l);
  };
  int l = 0;
  for (; l + 32 <= n; l += 32)
    for (int k = 0; k < 4; ++k) add(l + 8 * k, sums[k]);
  for (; l + 8 <= n; l += 8) add(l, sums[0]);
  double total = ((sums[0] + sums[1]) + (sums[2] + sums[3])).total();
  for (; l < n; ++l) total += weight[l] * psi[l];
  return total;
}

/// P <- weight P.
void multiply_stress(int n, int components, const double* weight, double* P) noexcept {
  for (int l = 0; l < n; l += pack_width) {
    const Pack w = Pack::load(weight + l);
    for (int c = 0; c < components; ++c) (w * Pack::load(P + c * batch_points + l)).store(P + c * batch_points + l);
  }
}

}  // namespace

void BatchWork::weigh_stress(int n, BatchScratch& s) const noexcept {
  const int d = dimension(laws_.space());
  if (s.stress_weight) multiply_stress(n, d * d, s.stress_weight, s.P);
}

/// Of lanes first ..., with their weights.
void BatchWork::add_energies(int n, const double* weight, const BatchScratch& s, int first, GroupEnergy* energy) const noexcept {
  if (energy_) energy->stored += weighted_energy(n, weight, s.psi + first);
  if (dissipates()) energy->dissipated += weighted_energy(n, weight, s.dissipated + first);
}

/// Laminates among n lanes, by the numbers that the space gave them.
void BatchWork::find_laminates(int n, const BatchScratch& s, bool both_ends, LaminateLanes& lanes) const noexcept {
  for (int l = 0; l < n; ++l) {
    if (!laminates_->near(s.owner[l]) || (!both_ends && laws_.record_of(static_cast<std::size_t>(s.owner[l])).silent)) continue;
    std::int64_t number = s.first_number >= 0 ? s.first_number + l : s.number[l];
    if (number < 0) continue;
    // Both ends of a bond that is evaluated once see the same.
    if (s.far_number > 0 && number >= s.far_number) number -= s.far_number;
    const LaminatePoint* const point = laminates_->at(number);
    if (!point) continue;
    lanes.lane[lanes.n] = l;
    lanes.point[lanes.n++] = point;
  }
}

/// A laminate carries the weights of both ends at once; those that store nothing add none.
void BatchWork::merge_weights(BatchScratch& s, const LaminateLanes& lanes) const noexcept {
  for (int k = 0; k < lanes.n; ++k) {
    const int l = lanes.lane[k];
    const auto silent = [&](std::int32_t p) { return laws_.record_of(static_cast<std::size_t>(p)).silent; };
    s.weight[l] = (silent(s.owner[l]) ? 0.0 : s.weight[l]) + (silent(s.far[l]) ? 0.0 : s.far_weight[l]);
    s.far_weight[l] = 0;
  }
}

/// Laminates among bonds, for each of their ends whose owner stores something; the second ones' lanes follow `lanes` later.
void BatchWork::repeat_for_ends(int lanes, const BatchScratch& s, int ends, LaminateLanes& of) const noexcept {
  const LaminateLanes bonds = of;
  of.n = 0;
  for (int end = 0; end < ends; ++end)
    for (int k = 0; k < bonds.n; ++k) {
      const int l = bonds.lane[k];
      if (laws_.record_of(static_cast<std::size_t>((end == 0 ? s.owner : s.far)[l])).silent) continue;
      of.lane[of.n] = end * lanes + l;
      of.point[of.n++] = bonds.point[k];
    }
}

/// Laminates in place of what one law gave on their lanes.
int BatchWork::evaluate_laminates(BatchScratch& s, double* P, double* dP, const LaminateLanes& lanes) const noexcept {
  LaminateBatch batch;
  batch.n = lanes.n;
  batch.lane = lanes.lane;
  batch.laminate = lanes.point;
  batch.H = s.H;
  batch.confined = confined() && !selective_;
  if (energy_ || screen_ || work_ == Work::sample) batch.psi = s.psi;
  batch.P = P;
  if (dP) batch.dH = s.dH;
  batch.dP = dP;
  if (work_ == Work::sample) batch.lateral = s.lateral;
  const int bad = s.laminate->evaluate(batch);
  if (bad >= 0) return bad;
  for (int k = 0; k < lanes.n && screen_; ++k) s.highest[lanes.lane[k]] = s.psi[lanes.lane[k]];
  return -1;
}

int BatchWork::pass(int n, BatchScratch& s, const std::int32_t* points, std::int64_t numbers, double* weight, double* P, GroupEnergy* energy,
                    const LaminateLanes* laminates) const noexcept {
  const bool tangent = work_ == Work::tangent;
  int bad = evaluate_laws(n, s, points, numbers, tangent ? nullptr : P, tangent ? P : nullptr);
  if (bad >= 0) return bad;
  if (laminates && laminates->n > 0) bad = evaluate_laminates(s, tangent ? nullptr : P, tangent ? P : nullptr, *laminates);
  if (bad >= 0) return bad;
  if (limits_step(s)) ask_for_steps(0, n, weight, s, numbers);
  add_energies(n, weight, s, 0, energy);
  if (along_) add_samples(n, s, s.own_weight, *along_, true);
  for (int l = 0; l < n && tangent; l += pack_width) (-Pack::load(weight + l)).store(weight + l);
  s.stress_weight = weight;
  return -1;
}

/// s.psi: the factors of the owners' evaluation points.
int BatchWork::balance_pass(int n, BatchScratch& s, bool both_ends) const noexcept {
  const Balance& b = *balance_;
  const int d = dimension(laws_.space());
  const double* const H = selective_ ? s.Ht : s.H;
  for (int c = 0; c < d * d; ++c) std::fill_n(s.P + c * batch_points, padded(static_cast<std::size_t>(n)), 0.0);
  for (int l = 0; l < n; ++l) {
    double trace = b.constant, stress = 0;
    for (int a = 0; a < d; ++a) trace += H[a * (d + 1) * batch_points + l];
    const auto add = [&](std::size_t owner, double weight) {
      if (!b.counted[owner] || weight == 0) return 0.0;
      const double factor = trace + b.multiplier[owner];
      stress += weight * factor;
      if (!b.factors) b.sums[owner] += weight * factor;
      return factor;
    };
    s.psi[l] = add(static_cast<std::size_t>(s.owner[l]), s.weight[l]);
    if (both_ends) add(static_cast<std::size_t>(s.far[l]), s.far_weight[l]);
    for (int a = 0; a < d; ++a) s.P[a * (d + 1) * batch_points + l] = stress;
  }
  std::fill_n(s.pressure, (both_ends ? 2 : 1) * padded(static_cast<std::size_t>(n)), 0.0);
  return -1;
}

/// Bonds with a far end: no point of this rank feels them, and their gradients are anything.
void BatchWork::leave_out_incomplete(int n, BatchScratch& s) const noexcept {
  for (int l = 0; l < n; ++l) {
    if (laws_.incomplete(static_cast<std::size_t>(s.owner[l])))
      s.far[l] = s.owner[l];
    else if (laws_.incomplete(static_cast<std::size_t>(s.far[l])))
      s.owner[l] = s.far[l];
  }
}

int BatchWork::evaluate(int n, BatchScratch& s, bool both_ends, GroupEnergy* energy) const noexcept {
  s.stress_weight = nullptr;
  if (balance_) return balance_pass(n, s, both_ends);
  if (both_ends && s.one_law < 0 && laws_.has_incomplete_points()) leave_out_incomplete(n, s);
  if (screen_) std::fill(std::begin(s.highest), std::end(s.highest), 0.0);
  if (selective_) return selective_pass(n, s, both_ends ? 2 : 1, energy);
  if (!laminates_ || s.one_law >= 0) return evaluate_plain(n, s, both_ends, energy, nullptr);
  LaminateLanes laminates;
  find_laminates(n, s, both_ends, laminates);
  if (laminates.n > 0 && both_ends) merge_weights(s, laminates);
  return evaluate_plain(n, s, both_ends, energy, &laminates);
}

int BatchWork::evaluate_plain(int n, BatchScratch& s, bool both_ends, GroupEnergy* energy, const LaminateLanes* laminates) const noexcept {
  const std::int32_t* owners = one_law(s) ? nullptr : s.owner;
  if (!both_ends) return pass(n, s, owners, 0, s.weight, s.P, energy, laminates);
  // A bond between equal records carries both weights at once; one between different records is evaluated from both ends.
  bool differ = false;
  if (along_) std::copy_n(s.weight, n, s.own_weight);
  if (one_law(s)) {
    for (int l = 0; l < n; ++l) s.weight[l] += s.far_weight[l];
  } else {
    for (int l = 0; l < n; ++l) {
      if (laws_.same(static_cast<std::size_t>(s.owner[l]), static_cast<std::size_t>(s.far[l]))) {
        s.weight[l] += s.far_weight[l];
        s.far_weight[l] = 0;
      } else {
        differ = true;
      }
    }
  }
  int bad = pass(n, s, owners, 0, s.weight, s.P, energy, laminates);
  if (bad >= 0 || !differ) return bad;
  // Laminates have no weight left here.
  bad = pass(n, s, s.far, s.far_number, s.far_weight, s.other, energy, nullptr);
  const int d = dimension(laws_.space());
  multiply_stress(n, d * d, s.weight, s.P);
  multiply_stress(n, d * d, s.far_weight, s.other);
  for (int c = 0; c < d * d; ++c)
    for (int l = 0; l < n; ++l) s.P[c * batch_points + l] += s.other[c * batch_points + l];
  s.stress_weight = nullptr;
  return bad;
}

void Pass::add_samples(int n, const BatchScratch& s, bool both_ends) {
  if (bonds)
    bonds->add(n, s, work.selective());
  else
    work.add_samples(n, s, *sums, both_ends);
}

void BatchWork::screen(std::int64_t first_point, int first_lane, int lanes, const BatchScratch& s) const noexcept {
  if (!screen_) return;
  constexpr auto group = static_cast<int>(padding);
  const double* limit = screen_->density.data() + first_point;
  bool near = false;
  for (int l = 0; l < lanes; ++l) near |= s.highest[first_lane + l] > limit[l % group];
  for (int l = 0; l < lanes && near; ++l)
    if (s.highest[first_lane + l] > limit[l % group]) screen_->mark(static_cast<std::size_t>(first_point + l % group));
}

bool BatchWork::may_hold_too_much(std::int64_t first_point, int lanes, const BatchScratch& s) const noexcept {
  constexpr auto group = static_cast<int>(padding);
  const double* limit = screen_->density.data() + first_point;
  bool any = false;
  for (int l = 0; l < lanes; ++l) any |= s.highest[l] > limit[l % group];
  return any;
}

void BatchWork::screen_bonds(int n, int far_end, const BatchScratch& s, const double* factor, const double* far_factor) const {
  const auto held = [&](const double* factors, int lane, int at) { return (factors && screen_->with_factors ? factors[lane] : 1.0) * s.highest[at]; };
  for (int l = 0; l < n; ++l) {
    const double psi = held(factor, l, l), far_psi = far_end < 0 ? 0.0 : held(far_factor, l, far_end + l);
    if (s.far[l] >= 0 && std::max(psi, far_psi) > screen_->density[static_cast<std::size_t>(s.owner[l])])
      screen_->look(s.owner[l], s.far[l], psi, far_psi);
  }
}

void BatchWork::screen(const std::int32_t* points, int count, int lanes, const BatchScratch& s) const noexcept {
  if (!screen_) return;
  for (int l = 0; l < lanes; ++l) {
    if (count > 1 && l % 8 >= count) continue;
    const auto p = static_cast<std::size_t>(points[count > 1 ? l % 8 : 0]);
    if (s.highest[l] > screen_->density[p]) screen_->mark(p);
  }
}

namespace {

/// What is summed: a value of each lane, and where its weighted sums go, by owner.
struct Sampled {
  const double* value;
  double* sum;
};

/// As packs do it.
double multiply_add(double a, double b, double c) noexcept {
#if defined(__FP_FAST_FMA)
  return __builtin_fma(a, b, c);
#else
  return a * b + c;
#endif
}

/// Lanes first ... first + 7 belong to the points from p on.
void add_eight(std::span<const Sampled> all, int first, std::size_t p, const double* weight) noexcept {
  for (int l = 0; l < 8; l += pack_width) {
    const Pack w = Pack::load(weight + first + l);
    const PackMask none = w == Pack(0.0);   // such lanes may hold anything
    for (const Sampled& q : all) {
      double* const to = q.sum + p + static_cast<std::size_t>(l);
      multiply_add(w, select(none, Pack(0.0), Pack::load(q.value + first + l)), Pack::load(to)).store(to);
    }
  }
}

/// Lanes first ... end - 1 belong to p, and are added in this order.
void add_run(std::span<const Sampled> all, int first, int end, std::size_t p, const double* weight) noexcept {
  const auto add = [&](auto count, const Sampled* q) {
    double total[count.value];
    for (int k = 0; k < count.value; ++k) total[k] = q[k].sum[p];
    for (int l = first; l < end; ++l) {
      if (weight[l] == 0) continue;
      for (int k = 0; k < count.value; ++k) total[k] = multiply_add(weight[l], q[k].value[l], total[k]);
    }
    for (int k = 0; k < count.value; ++k) q[k].sum[p] = total[k];
  };
  // Four sums at a time: each waits for itself.
  std::size_t q = 0;
  for (; q + 4 <= all.size(); q += 4) add(std::integral_constant<int, 4>(), &all[q]);
  for (; q < all.size(); ++q) add(std::integral_constant<int, 1>(), &all[q]);
}

/// Lane l belongs to points[l].
void add_lanes(std::span<const Sampled> all, int n, const std::int32_t* points, const double* weight) noexcept {
  for (int l = 0; l < n;) {
    const std::int32_t p = points[l];
    int next = 1;
    while (next < 8 && l + next < n && points[l + next] == p + next) ++next;
    if (next == 8) {
      add_eight(all, l, static_cast<std::size_t>(p), weight);
      l += 8;
      continue;
    }
    int end = l + 1;
    while (end < n && points[end] == p) ++end;
    add_run(all, l, end, static_cast<std::size_t>(p), weight);
    l = end;
  }
}

}  // namespace

void BatchWork::add_samples(int n, const BatchScratch& s, const double* weight, const SampleSums& sums, bool both_ends) const noexcept {
  static constexpr auto ones = [] {
    std::array<double, batch_points> all{};
    all.fill(1.0);
    return all;
  }();
  const Space space = laws_.space();
  const int d = dimension(space), components = tensor_components(space);
  const bool stress_space = space == Space::plane_stress || space == Space::line_stress;
  Sampled all[2 + 9 + 1 + 2 * 9];
  std::size_t count = 0;
  const auto to = [&](const double* value, double* sum, int c) { all[count++] = {value, sum + static_cast<std::size_t>(c) * sums.stride}; };
  to(s.psi, sums.psi, 0);
  LaneStresses stresses;
  if (sums.weight) to(ones.data(), sums.weight, 0);
  if (sums.von_mises || sums.cauchy) stresses.find(n, space, s, sums.cauchy != nullptr);
  if (sums.von_mises) to(stresses.von_mises, sums.von_mises, 0);
  for (int c = 0; c < 9 && sums.cauchy; ++c) to(stresses.sigma[c], sums.cauchy, c);
  for (int c = 0; c < components && sums.H; ++c) to(stress_space && c >= d * d ? s.lateral : s.H + c * batch_points, sums.H, c);
  for (int c = 0; c < components && sums.P; ++c) to(s.P + c * batch_points, sums.P, c);
  add_lanes({all, count}, n, s.owner, weight);
  if (both_ends) add_lanes({all, count}, n, s.far, s.far_weight);
}

}  // namespace perikit
