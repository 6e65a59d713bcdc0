#include "spaces/lattice/lattice_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace perikit {

namespace {

/// Slots of a bond batch: batch_points lanes, chunk_points of them a slot.
constexpr int slots_at_once = batch_points / chunk_points;

/// Length of the run of adjacent chunks that starts at c, at most `most`.
int run_length(const std::vector<LatticeChunk>& chunks, std::size_t c, std::size_t end, int most) noexcept {
  int n = 1;
  while (n < most && c + static_cast<std::size_t>(n) < end && chunks[c + static_cast<std::size_t>(n)].first == chunks[c].first + n * chunk_points) ++n;
  return n;
}

}  // namespace

template <int D>
LatticeBonds<D>::LatticeBonds(const SpaceParts& parts)
    : families_(*parts.families.lattice()),
      tiles_(families_.tiles),
      formulation_(parts.formulation),
      laws_(parts.laws),
      selective_(formulation_.selective()),
      far_share_(formulation_.far_share),
      without_(families_),
      pairs_(formulation_.pair_symmetric && parts.share),
      two_states_(pairs_ && (selective_ || !laws_.single())),
      slots_at_once_(selective_ && pairs_ ? slots_at_once / 2 : slots_at_once),
      roles_(families_, laws_, slots_each(), static_cast<std::size_t>(slots_at_once_)),
      every_slot_(slot_batches(std::vector<bool>(families_.slots.size(), true), static_cast<std::size_t>(slots_at_once_))),
      operator_(families_) {
  quiet_ = parts.quiet_blocks(tiles_.reach);
  const Body& body = families_.body();
  if (formulation_.order > 1) stencils_.emplace(families_, formulation_.order);
  flux_ = body.make_field(D * D);
  gradient_ = body.make_field(D * D);
  scale_ = body.make_field(1);
  for (const LatticeChunk& chunk : tiles_.chunks) std::copy_n(families_.pattern(chunk).scale_of(formulation_.weight), chunk_points, scale_.data() + chunk.first);
  set_whole_vectors();
  if (!formulation_.g_from_xi_only) store_corrections();
  if (!selective_) return;
  volume_ = body.make_field(volume_components);
  pressure_ = body.make_field(2);
  for (const std::int32_t p : body.internal()) volume_.component(volume_share)[p] = share_of_volume(static_cast<std::size_t>(p));
}

/// c of the selective map (maps/selective_map.hpp).
template <int D>
double LatticeBonds<D>::share_of_volume(std::size_t p) const noexcept {
  const LatticePattern& pattern = families_.pattern_at(p);
  return pattern.singular >> (p % chunk_points) & 1 ? 0.0 : pattern.left[p % chunk_points];
}

template <int D>
void LatticeBonds<D>::bonds_changed(std::span<const std::int32_t> points) {
  last_ = Last::other;
  without_.renew(points);
  for (const std::int32_t p : points) {
    const LatticeChunk& chunk = tiles_.chunks[static_cast<std::size_t>(tiles_.chunk_of(p))];
    if (selective_) volume_.component(volume_share)[p] = share_of_volume(static_cast<std::size_t>(p));
    if (stencils_) stencils_->renew(chunk);
  }
}

template <int D>
void LatticeBonds<D>::gradients(std::size_t b, Pass& pass) {
  const LatticeBlock& block = tiles_.blocks[b];
  const bool tangent = pass.work.tangent();
  if (!pass.gathers_only()) {
    tiles_.clear(b, flux_);
    if (selective_) tiles_.clear(b, pressure_);
  }
  for (std::size_t c = block.chunk_begin; c < block.chunk_end;) {
    const LatticeChunk& chunk = tiles_.chunks[c];
    if (!roles_.wants(c, &ChunkRole::gradient)) {
      ++c;
      continue;
    }
    int n = stencils_ ? 1 : run_length(tiles_.chunks, c, block.chunk_end, 4);
    while (n > 1 && !roles_.wants(c + static_cast<std::size_t>(n) - 1, &ChunkRole::gradient)) --n;
    bool wanted = false;
    for (int k = 0; k < n; ++k) wanted |= pass.gradient_wanted(chunk.first + k * chunk_points);
    if (!wanted) {
      c += static_cast<std::size_t>(n);
      continue;
    }
    if (stencils_) {
      stencils_->gradient(chunk, pass.u, gradient_);
      if (tangent) stencils_->gradient(chunk, pass.w, direction_);
    } else {
      operator_.gradient(&chunk, n, pass.u, gradient_.data() + chunk.first, gradient_.stride());
      if (tangent) operator_.gradient(&chunk, n, pass.w, direction_.data() + chunk.first, direction_.stride());
    }
    c += static_cast<std::size_t>(n);
  }
  for (std::size_t c = block.chunk_begin; c < block.chunk_end && selective_; ++c) {
    const LatticeChunk& chunk = tiles_.chunks[c];
    if (pass.gradient_wanted(chunk.first)) owner_volume(laws_.space(), owner_gradients(chunk, tangent), volume_.data() + chunk.first, volume_.stride());
  }
}

template <int D>
OwnerGradients LatticeBonds<D>::owner_gradients(const LatticeChunk& chunk, bool tangent) const noexcept {
  return {chunk_points, gradient_.stride(), gradient_.data() + chunk.first, tangent ? direction_.data() + chunk.first : nullptr};
}

/// Volume changes of the owners, and those of the far ends after them.
template <int D>
void LatticeBonds<D>::point_to_volumes(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s) const noexcept {
  s.owner_volumes = {volume_.data(), volume_.stride(), s.volume_group, !families_.any_weak()};
  std::fill_n(s.volume_group, slots, chunk.first);
  for (int k = 0; k < slots && pairs_; ++k) s.volume_group[slots + k] = chunk.first + families_.slots.shifts[slot + static_cast<std::size_t>(k)];
}

template <int D>
void LatticeBonds<D>::add_pressures(const LatticeChunk& chunk, std::size_t slot, int slots, const BatchScratch& s, bool both_ends, bool tangent) noexcept {
  const LatticePattern& pattern = families_.pattern(chunk);
  for (int c = 0; c < (tangent ? 2 : 1); ++c) {
    const double* from = c == 0 ? s.pressure : s.pressure_rate;
    double* to = pressure_.component(c) + chunk.first;
    for (int l = 0; l < chunk_points; l += pack_width) {
      Pack own = Pack::load(to + l);
      for (int k = 0; k < slots; ++k) own += Pack::load(from + k * chunk_points + l);
      own.store(to + l);
    }
    for (int k = 0; k < slots && both_ends; ++k) {
      const std::size_t at = slot + static_cast<std::size_t>(k);
      for (int l = 0; l < chunk_points; l += pack_width)
        add_to_cells(to + families_.slots.shifts[at] + l, Pack::load(from + (slots + k) * chunk_points + l), pack_mask(pattern.mask[at], l));
    }
  }
}

/// Stable numbers: of bonds that are evaluated once, those of their slot in the first half; of point l of a chunk. -1: a bond of the second half that
/// is not there.
template <int D>
std::int64_t LatticeBonds<D>::state_number(std::size_t index, std::size_t slot, int l) const noexcept {
  const auto of = [&](std::size_t chunk, std::size_t at) { return static_cast<std::int64_t>((chunk * slots_each() + at) * chunk_points); };
  if (slot < slots_each()) return of(index, slot) + l;
  const LatticeChunk& chunk = tiles_.chunks[index];
  if (!families_.pattern(chunk).intact(slot, l)) return -1;
  const std::int64_t far = chunk.first + l + families_.slots.shifts[slot];
  const bool same = !two_states_ || (!selective_ && laws_.same(static_cast<std::size_t>(chunk.first + l), static_cast<std::size_t>(far)));
  return of(static_cast<std::size_t>(tiles_.chunk_of(far)), families_.slots.reverse(slot)) + far % chunk_points + (same ? 0 : far_number());
}

/// whole: this batch has the slots that are numbered, one after the other.
template <int D>
void LatticeBonds<D>::number(std::size_t index, std::size_t slot, int slots, bool whole, BatchScratch& s) const noexcept {
  s.far_number = far_number();
  s.first_number = whole ? state_number(index, slot, 0) : -1;
  for (int lane = 0; lane < slots * chunk_points && !whole; ++lane)
    s.number[lane] = state_number(index, slot + static_cast<std::size_t>(lane / chunk_points), lane % chunk_points);
}

template <int D>
int LatticeBonds<D>::bonds_of_chunk(std::size_t index, std::size_t slot, int slots, BatchScratch& s, Pass& pass, GroupEnergy* energy,
                                    std::vector<OneSidedStress>& later) {
  const LatticeChunk& chunk = tiles_.chunks[index];
  const LatticePattern& pattern = families_.pattern(chunk);
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, both_ends = pairs_ && !pass.gathers_only(), sampled_pairs = samples_pairs(pass);
  const std::int64_t p = chunk.first;
  double* const H = selective_ ? s.Ht : s.H;
  double* const dH = selective_ ? s.dHt : s.dH;
  if (selective_) point_to_volumes(chunk, slot, slots, s);
  BondVectors vectors;
  bond_vectors(chunk, slot, slots, s, vectors);
  const int lanes = slots * chunk_points;
  // Local copies, here and below: a pack that is stored may be any member, so that the compiler would read each again for every slot.
  const std::int64_t* const shifts = families_.slots.shifts.data() + slot;
  const std::uint8_t* const masks = pattern.mask.data() + slot;
  const auto gradient = [&](auto per_slot, auto of_both, ConstFieldView u, ConstFieldView Hbar, double* to) {
    lattice_bond_gradient<D, per_slot.value, of_both.value>(shifts, masks, slots, p, vectors, far_share_, u, Hbar, to);
  };
  const auto adjoint = [&](auto per_slot, auto of_both, auto weighs) {
    lattice_bond_adjoint<D, per_slot.value, of_both.value, weighs.value>(shifts, masks, slots, p, vectors, far_share_, s.P, s.stress_weight, pass.out,
                                                                         flux_);
  };
  // The kernels are compiled for each way of reading the bond vectors and each base.
  using std::false_type, std::true_type;
  const auto choose = [&](const auto& kernel, auto... arguments) {
    const bool both = far_share_ > 0;
    if (vectors.per_slot)
      both ? kernel(true_type(), true_type(), arguments...) : kernel(true_type(), false_type(), arguments...);
    else
      both ? kernel(false_type(), true_type(), arguments...) : kernel(false_type(), false_type(), arguments...);
  };
  choose(gradient, pass.u, ConstFieldView(gradient_), H);
  if (tangent) choose(gradient, pass.w, ConstFieldView(direction_), dH);
  const double* const integrity = pattern.integrity.empty() ? nullptr : pattern.b_of(slot);
  const auto weigh = [&, slot_weight = slot_weight_.data() + slot](const double* end_scale, const std::int64_t* moved, double* weight) {
    for (int k = 0; k < slots; ++k) {
      const double* const b = integrity ? integrity + k * chunk_points : lane_factors[masks[k]];
      const double* const scale = moved ? end_scale + moved[k] : end_scale;
      for (int l = 0; l < chunk_points; l += pack_width)
        (Pack::load(b + l) * Pack(slot_weight[k]) * Pack::load(scale + l)).store(weight + k * chunk_points + l);
    }
  };
  weigh(pattern.scale_of(formulation_.weight), nullptr, s.weight);
  if (both_ends || sampled_pairs) weigh(scale_.data() + p, shifts, s.far_weight);
  if (without_.any()) {
    one_sided_gradients(chunk, slot, slots, vectors, pass.u, gradient_, H, s);
    if (tangent) one_sided_gradients(chunk, slot, slots, vectors, pass.w, direction_, dH, s);
  }
  const auto set_ends = [&] {
    for (int k = 0; k < slots; ++k)
      for (int l = 0; l < chunk_points; ++l) {
        s.owner[k * chunk_points + l] = chunk.first + l;
        s.far[k * chunk_points + l] = static_cast<std::int32_t>((masks[k] >> l & 1) ? p + shifts[k] + l : p + l);
      }
  };
  if (pass.work.samples() || (!laws_.single() && s.one_law < 0) || pass.work.wants_ends()) set_ends();
  if (pass.work.numbered()) number(index, slot, slots, slot + static_cast<std::size_t>(slots) <= slots_each(), s);
  const int bad = pass.work.evaluate(lanes, s, both_ends, energy);
  if (bad >= 0) return bad;
  if (pass.work.screens_bonds() && pass.work.may_hold_too_much(p, selective_ && both_ends ? 2 * lanes : lanes, s)) {
    set_ends();
    pass.work.screen_bonds(lanes, !both_ends ? -1 : selective_ ? lanes : 0, s);
  }
  if (sample) {
    const bool one_law = laws_.single() || s.one_law >= 0;
    pass.add_samples(lanes, s, sampled_pairs && one_law);
    return sampled_pairs && !one_law ? sample_far_ends(lanes, s, pass) : -1;
  }
  if (pass.gathers_only()) return -1;
  s.stress_weight ? choose(adjoint, true_type()) : choose(adjoint, false_type());
  if (without_.any()) one_sided_stress(chunk, slot, slots, vectors, s, later);
  if (selective_) add_pressures(chunk, slot, slots, s, both_ends, tangent);
  return -1;
}

template <int D>
template <class Visit>
void LatticeBonds<D>::over_one_sided(const LatticeChunk& chunk, std::size_t slot, int slots, Visit&& visit) const {
  const LatticePattern& pattern = families_.pattern(chunk);
  for (int k = 0; k < slots; ++k)
    for (int l = 0; l < chunk_points; ++l) {
      if (!pattern.intact(slot + static_cast<std::size_t>(k), l)) continue;
      const auto near = static_cast<std::size_t>(chunk.first + l);
      const auto far = near + static_cast<std::size_t>(families_.slots.shifts[slot + static_cast<std::size_t>(k)]);
      if (without_[near] || without_[far]) visit(k * chunk_points + l, k, near, far, end_shares(far_share_, !without_[near], !without_[far]));
    }
}

/// Replaces the H of bonds beside points without a gradient. Where neither end has one, a law with history may still hold a stress: it has no weight.
template <int D>
void LatticeBonds<D>::one_sided_gradients(const LatticeChunk& chunk, std::size_t slot, int slots, const BondVectors& vectors, ConstFieldView u,
                                          ConstFieldView Hbar, double* H, BatchScratch& s) const noexcept {
  over_one_sided(chunk, slot, slots, [&](int lane, int k, std::size_t near, std::size_t far, const EndShares& shares) {
    if (shares.none()) s.weight[lane] = s.far_weight[lane] = 0;
    double xi[D], g[D], A[D], row[D];
    vectors.of(lane, k, xi, g);
    for (int c = 0; c < D; ++c) {
      for (int e = 0; e < D; ++e) A[e] = shares.near * Hbar.component(c * D + e)[near] + shares.far * Hbar.component(c * D + e)[far];
      bond_shape_row<D>(A, u.component(c)[far] - u.component(c)[near], xi, g, row);
      for (int e = 0; e < D; ++e) H[(c * D + e) * batch_points + lane] = shares.none() ? 0.0 : row[e];
    }
  });
}

template <int D>
void LatticeBonds<D>::one_sided_stress(const LatticeChunk& chunk, std::size_t slot, int slots, const BondVectors& vectors, const BatchScratch& s,
                                       std::vector<OneSidedStress>& later) const {
  over_one_sided(chunk, slot, slots, [&](int lane, int k, std::size_t near, std::size_t far, const EndShares& shares) {
    if (shares.none()) return;
    OneSidedStress& out = later.emplace_back(OneSidedStress{near, far, {shares.near - (1 - far_share_), shares.far - far_share_}, {}});
    double xi[D], g[D], row[D];
    vectors.of(lane, k, xi, g);
    for (int c = 0; c < D; ++c) {
      for (int e = 0; e < D; ++e) row[e] = (s.stress_weight ? s.stress_weight[lane] : 1.0) * s.P[(c * D + e) * batch_points + lane];
      bond_shape_row_adjoint<D>(row, xi, g);
      std::copy_n(row, D, out.stress + c * D);
    }
  });
}

template <int D>
void LatticeBonds<D>::give(const std::vector<OneSidedStress>& corrections) noexcept {
  for (const OneSidedStress& at : corrections)
    for (int c = 0; c < D * D; ++c) {
      flux_.component(c)[at.near] += at.shares.near * at.stress[c];
      flux_.component(c)[at.far] += at.shares.far * at.stress[c];
    }
}

template <int D>
void LatticeBonds<D>::bonds(std::size_t b, Pass& pass) {
  const LatticeBlock& block = tiles_.blocks[b];
  BatchScratch& s = scratch_.mine();
  const bool all = pass.gathers_only();
  const std::vector<SlotBatch>& of_all = samples_pairs(pass) ? roles_.slots.front() : every_slot_;
  std::vector<OneSidedStress> later;
  for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
    const LatticeChunk& chunk = tiles_.chunks[c];
    if (!pass.wanted(chunk.first) || !roles_.wants(c, &ChunkRole::bonds)) continue;
    GroupEnergy energy;
    s.one_law = roles_.chunk.empty() || pass.work.laminates_near(chunk.first) ? ChunkRole::mixed : roles_.chunk[c].law;
    for (const auto& [slot, count] : all ? of_all : roles_.slots_of(c)) {
      const int bad = bonds_of_chunk(c, slot, count, s, pass, &energy, later);
      if (bad >= 0) return pass.report(chunk.first + bad % chunk_points);
    }
    // After all slots: ranks that leave out slots that nobody feels take the others in other batches, and a point gets its share from several slots.
    give(later);
    later.clear();
    if (pass.energies) pass.energies[chunk.first / chunk_points] = energy;
  }
}

/// What is left to do with the stress on Hbar once all bonds are in.
template <int D>
void LatticeBonds<D>::finish_stress(std::size_t b, Pass& pass) {
  for (std::size_t c = tiles_.blocks[b].chunk_begin; c < tiles_.blocks[b].chunk_end; ++c) {
    const LatticeChunk& chunk = tiles_.chunks[c];
    if (!pass.gradient_wanted(chunk.first) || !roles_.wants(c, &ChunkRole::stress)) continue;
    double* const stress = flux_.data() + chunk.first;
    if (selective_) {
      add_owner_stress(laws_.space(), owner_gradients(chunk, pass.work.tangent()), pressure_.component(0) + chunk.first, pressure_.component(1) + chunk.first,
                       stress, flux_.stride());
    }
    if (stencils_) continue;
    operator_.stress_to_flux(chunk, stress, flux_.stride(), flux_, chunk.first);
    operator_.own_flux(chunk, flux_, chunk.first, pass.out);
  }
}

/// Averages at points: what one evaluation says of a bond counts at either end.
template <int D>
bool LatticeBonds<D>::samples_pairs(const Pass& pass) const noexcept {
  return pairs_ && pass.sums && !selective_ && !pass.work.numbered();
}

/// After the samples of their owners, whose laws may be others. Returns the first bad lane or -1.
template <int D>
int LatticeBonds<D>::sample_far_ends(int lanes, BatchScratch& s, Pass& pass) {
  std::swap_ranges(s.owner, s.owner + lanes, s.far);
  std::swap_ranges(s.weight, s.weight + lanes, s.far_weight);
  const int bad = pass.work.evaluate(lanes, s, false, nullptr);
  if (bad < 0) pass.add_samples(lanes, s);
  return bad;
}

/// Adds the adjoint of the point gradient, as pass `number`: of Q, or of the stress on Hbar for stored stencils.
template <int D>
void LatticeBonds<D>::divergence(Pass& pass, int number) const {
  tiles_.colouring.for_each([&](std::size_t b) {
    if (!quiet_.awake(b, number) || !here(b, pass)) return;
    const LatticeBlock& block = tiles_.blocks[b];
    for (std::size_t c = block.chunk_begin; c < block.chunk_end && stencils_; ++c)
      if (pass.gradient_wanted(tiles_.chunks[c].first)) stencils_->adjoint(tiles_.chunks[c], flux_, pass.out);
    if (stencils_) return;
    for (std::size_t r = block.row_begin; r < block.row_end; ++r) {
      const LatticeRow& row = tiles_.rows[r];
      if (roles_.wants_row(r) && row.marked(pass.near)) operator_.divergence(row, flux_, row.first, pass.out);
    }
    for (std::size_t c = block.chunk_begin; c < block.chunk_end && families_.any_broken(); ++c)
      if (pass.gradient_wanted(tiles_.chunks[c].first)) operator_.remove_broken(tiles_.chunks[c], flux_, tiles_.chunks[c].first, {}, pass.out);
  });
}

template <int D>
void LatticeBonds<D>::run(Pass& pass) {
  scratch_.prepare(laws_, pass.work.laminates());
  constexpr int last = 3;
  last_ = pass.work.work() != Work::force || pass.work.balance() ? Last::other : pass.only ? Last::some_forces : Last::all_forces;
  if (pass.work.tangent() && direction_.size() == 0) direction_ = families_.body().make_field(D * D);
  if (pass.everywhere())
    quiet_.wake();
  else
    quiet_.look(
        last, [&](std::size_t b) { return tiles_.moves(b, pass.u); }, pass.arrival);
  // Each pass reads what the one before it left at one family's reach.
  const auto awake = [&](auto&& block) {
    return [&](std::size_t b) {
      if (quiet_.awake(b, 2) && here(b, pass)) block(b);
    };
  };
  tiles_.sequence.for_each(
      [&](std::size_t b) {
        if (quiet_.begins(b) && here(b, pass)) gradients(b, pass);
      },
      pass.arrival);
  if (samples_pairs(pass)) return tiles_.colouring.for_each([&](std::size_t b) { bonds(b, pass); });
  if (pass.gathers_only()) return parallel_for(blocks(), [&](std::size_t b) { bonds(b, pass); });
  tiles_.colouring.for_each(awake([&](std::size_t b) { bonds(b, pass); }));
  parallel_for(blocks(), awake([&](std::size_t b) { finish_stress(b, pass); }));
  if (pass.bad < 0) divergence(pass, last);
  tiles_.clear_dead(pass.out);
}

template <int D>
void LatticeBonds<D>::report(ModelReport& report) const {
  report.fallbacks += stencils_ ? stencils_->fallbacks() : 0;
  report.bytes += (stencils_ ? stencils_->bytes() : 0) + flux_.bytes() + gradient_.bytes() + direction_.bytes() + scale_.bytes() + volume_.bytes() +
                  pressure_.bytes() + scratch_.bytes() + (pattern_g_.size() + 1) * lane_xi_.size() * sizeof(double);
  report.evaluation_points += pairs_ ? families_.bonds() / 2 : families_.bonds();
  if (pairs_) report.skips.push_back(second_evaluation(families_.bonds()));
}

template class LatticeBonds<1>;
template class LatticeBonds<2>;
template class LatticeBonds<3>;

}  // namespace perikit
