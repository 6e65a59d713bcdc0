#include "spaces/lattice_model.hpp"
#include "operators/samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace perikit {

namespace {

/// Slots of a bond batch: batch_points lanes, chunk_points of them a slot.
constexpr int slots_at_once = batch_points / chunk_points;
/// Corrections of families that are not whole are stored by pattern up to this many bytes, else computed when needed.
constexpr std::size_t stored_corrections = std::size_t{64} << 20;

/// Lanes of a chunk whose bond at a slot exists, as factors.
struct LaneFactors {
  alignas(64) double value[256][chunk_points];
  LaneFactors() {
    for (int m = 0; m < 256; ++m)
      for (int l = 0; l < chunk_points; ++l) value[m][l] = (m >> l & 1) ? 1.0 : 0.0;
  }
};
const LaneFactors& lane_factors() {
  static const LaneFactors factors;
  return factors;
}

/// Rows of a block that are taken together: whole batches for the law where rows are short.
std::size_t rows_at_once(const LatticeRow& row) noexcept { return static_cast<std::size_t>(std::max(1, slots_at_once / row.chunks)); }

}  // namespace

template <int D>
LatticeModel<D>::LatticeModel(const ModelParts& parts)
    : AssemblingModel(parts), body_(*parts.body), laws_(*parts.laws), formulation_(parts.formulation),
      pairs_(formulation_.pair_symmetric && parts.share && !laws_.history()),
      families_(body_, *parts.influence, formulation_.weight, laws_.history() && formulation_.point), operator_(families_),
      slots_at_once_(formulation_.selective() && pairs_ ? slots_at_once / 2 : slots_at_once) {
  if (parts.skip && !laws_.history()) quiet_ = QuietBlocks(families_.reach);
  if (parts.damage) this->watch_bonds(bonds_.emplace(families_));
  const auto alive = body_.alive_bits();
  for (const LatticeRow& row : families_.rows)
    for (int c = 0; c < row.chunks; ++c) {
      const std::int32_t first = row.first + c * chunk_points;
      const std::uint8_t live = alive[static_cast<std::size_t>(first / chunk_points)];
      if (live != 0xff) partly_dead_.emplace_back(first, live);
    }
  if (!formulation_.bond) {
    row_gap_ = static_cast<std::int64_t>(padded(static_cast<std::size_t>(families_.row_reach)));
    for (const LatticeRow& row : families_.rows) most_cells_ = std::max(most_cells_, static_cast<std::int64_t>(rows_at_once(row)) * row_width(row));
    return;
  }
  if (formulation_.order > 1) stencils_.emplace(families_, formulation_.order);
  flux_ = body_.make_field(D * D);
  gradient_ = body_.make_field(D * D);
  if (formulation_.selective()) {
    volume_ = body_.make_field(volume_components);
    pressure_ = body_.make_field(2);
    for (const LatticeChunk& chunk : families_.chunks)
      for (int l = 0; l < chunk_points; ++l) volume_.component(volume_share)[chunk.first + l] = share_of_volume(chunk, l);
  }
  scale_ = body_.make_field(1);
  for (const LatticeChunk& chunk : families_.chunks) {
    std::memcpy(scale_.data() + chunk.first, families_.pattern(chunk).scale, sizeof families_.whole.scale);
  }
  // Bonds of whole families: one vector per slot, from one call on the whole family.
  const std::size_t slots = families_.offsets.size(), size = padded(slots);
  std::vector<double> length(size, 1.0), volume(size, 0.0), omega(size, 0.0), g(size * D);
  for (int c = 0; c < D; ++c) slot_xi_[c].assign(size, 1.0);
  for (std::size_t s = 0; s < slots; ++s) {
    double r2 = 0;
    const auto xi = families_.bond(s);
    for (int c = 0; c < D; ++c) {
      slot_xi_[c][s] = xi[static_cast<std::size_t>(c)];
      r2 += slot_xi_[c][s] * slot_xi_[c][s];
    }
    length[s] = std::sqrt(r2);
    volume[s] = families_.volume;
    omega[s] = families_.omega[s];
    slot_weight_.push_back(families_.volume * (formulation_.weight == BondWeight::kernel ? omega[s] : 1.0));
  }
  FamilyView view{D, static_cast<int>(slots), body_.horizon(), {slot_xi_[0].data(), slot_xi_[1].data(), slot_xi_[2].data()},
                  length.data(), volume.data(), omega.data(), nullptr, 0};
  double inverse[6];
  families_.inverse_shape(families_.whole, 0, inverse);
  view.inverse_shape = inverse;
  formulation_.bond->correction(view, g.data(), size);
  for (int c = 0; c < D; ++c) slot_g_[c].assign(g.begin() + static_cast<std::ptrdiff_t>(c * size), g.begin() + static_cast<std::ptrdiff_t>((c + 1) * size));
  if (!formulation_.g_from_xi_only) store_corrections();
}

template <int D>
void LatticeModel<D>::store_corrections() {
  const std::size_t slots = families_.offsets.size(), groups = (slots + slots_at_once - 1) / slots_at_once, size = groups * D * batch_points;
  if (families_.patterns.size() * size * sizeof(double) > stored_corrections) return;
  auto scratch = std::make_unique<BatchScratch>();
  std::vector<AlignedVector<double>> stored(families_.patterns.size(), AlignedVector<double>(size, 0.0));
  lane_xi_.assign(size, 0.0);
  for (std::size_t k = 0; k < stored.size(); ++k) {
    for (std::size_t slot = 0; slot < slots; slot += slots_at_once) {
      BondVectors vectors;
      const int n = static_cast<int>(std::min<std::size_t>(slots_at_once, slots - slot));
      bond_vectors({0, static_cast<std::int32_t>(k)}, slot, n, *scratch, vectors);
      for (std::size_t c = 0; c < D; ++c) {
        const std::size_t first = (slot / slots_at_once * D + c) * batch_points;
        std::copy_n(vectors.g[c], n * chunk_points, stored[k].data() + first);
        std::copy_n(vectors.xi[c], n * chunk_points, lane_xi_.data() + first);
      }
    }
  }
  pattern_g_ = std::move(stored);
}

template <int D>
void LatticeModel<D>::zero_rows(const LatticeBlock& block, FieldView out) const noexcept {
  for (std::size_t r = block.row_begin; r < block.row_end; ++r) {
    const LatticeRow& row = families_.rows[r];
    for (int c = 0; c < out.components; ++c) {
      std::memset(out.component(c) + row.first, 0, sizeof(double) * static_cast<std::size_t>(row.chunks) * chunk_points);
    }
  }
}

/// Length of the run of adjacent chunks that starts at c, at most `most`.
static int run_length(const std::vector<LatticeChunk>& chunks, std::size_t c, std::size_t end, int most) noexcept {
  int n = 1;
  while (n < most && c + static_cast<std::size_t>(n) < end && chunks[c + static_cast<std::size_t>(n)].first == chunks[c].first + n * chunk_points) ++n;
  return n;
}

/// The law of n chunks, whose gradients are in the lanes of s. Returns the first bad point or -1.
template <int D>
std::int64_t LatticeModel<D>::evaluate_chunks(const std::int32_t* index, int n, BatchScratch& s, const Pass& pass, double* energy) const {
  const auto chunk = [&](int i) -> const LatticeChunk& { return families_.chunks[static_cast<std::size_t>(index[i])]; };
  for (int i = 0; i < n; ++i) {
    const int lane = i * chunk_points;
    std::memcpy(s.weight + lane, families_.pattern(chunk(i)).weight, sizeof families_.whole.weight);
    if (!laws_.single() || pass.alone()) {
      for (int l = 0; l < chunk_points; ++l) s.owner[lane + l] = chunk(i).first + l;
    }
  }
  const int bad = pass.work.evaluate(n * chunk_points, s, false, energy);
  return bad < 0 ? -1 : chunk(bad / chunk_points).first + bad % chunk_points;
}

/// Energies or samples of points, one by one.
template <int D>
void LatticeModel<D>::points_block(std::size_t b, Pass& pass) {
  const LatticeBlock& block = families_.blocks[b];
  BatchScratch& s = scratch_.begin_block(b);
  double energy = 0;
  std::int32_t index[slots_at_once];
  int n = 0;
  for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
    if (pass.wanted(families_.chunks[c].first)) {
      operator_.gradient(&families_.chunks[c], 1, pass.u, s.H + n * chunk_points, batch_points);
      index[n++] = static_cast<std::int32_t>(c);
    }
    if (n == 0 || (n < slots_at_once && c + 1 < block.chunk_end)) continue;
    const std::int64_t bad = evaluate_chunks(index, n, s, pass, &energy);
    if (bad >= 0) {
      pass.report(bad);
      return;
    }
    if (pass.work.work() == Work::sample) {
      // The average over one evaluation point is its value, whatever its weight.
      for (int l = 0; l < n * chunk_points; ++l) {
        const LatticePattern& pattern = families_.pattern(families_.chunks[static_cast<std::size_t>(index[l / chunk_points])]);
        if (s.weight[l] == 0 && (pattern.live >> (l % chunk_points) & 1)) s.weight[l] = 1e-300;
      }
      pass.work.add_samples(n * chunk_points, s, *pass.sums);
    }
    n = 0;
  }
  if (pass.energies) pass.energies[b] = energy;
}

/// Cells of a row in the memory of Q: with a gap before it and after it, zero, or Q of the chunks that families reach there.
template <int D>
std::int64_t LatticeModel<D>::row_width(const LatticeRow& row) const noexcept {
  return std::int64_t(row.chunks) * chunk_points + 2 * row_gap_;
}

/// Where Q of the live chunks of rows that follow each other goes, and zeros around them; `chunk` is the first chunk of the rows, and then the
/// one after their last.
template <int D>
void LatticeModel<D>::place_rows(std::span<const LatticeRow> rows, std::size_t& chunk, std::size_t end, RowScratch& r) const {
  const auto zero = [&](std::int64_t from, std::int64_t to) {
    for (int c = 0; c < D * D && to > from; ++c) std::memset(r.flux.component(c) + from, 0, sizeof(double) * static_cast<std::size_t>(to - from));
  };
  r.index.clear();
  r.at.clear();
  std::int64_t start = row_gap_;
  for (const LatticeRow& row : rows) {
    std::int64_t filled = start - row_gap_;
    for (; chunk < end && row.holds(families_.chunks[chunk].first); ++chunk) {
      const std::int64_t to = start + families_.chunks[chunk].first - row.first;
      zero(filled, to);
      filled = to + chunk_points;
      r.index.push_back(static_cast<std::int32_t>(chunk));
      r.at.push_back(to);
    }
    start += row_width(row);
    zero(filled, start - row_gap_);
  }
  r.own = r.index.size();
  // Where a row goes on in another block, families reach into Q of its chunks: computed here, too.
  start = row_gap_;
  for (const LatticeRow& row : rows) {
    const auto place = [&](std::int32_t k) {
      const std::int32_t outside = families_.chunk_of(row.first + k * chunk_points);
      if (outside < 0) return;
      r.index.push_back(outside);
      r.at.push_back(start + k * chunk_points);
    };
    for (std::int32_t k = -row.before; k < 0; ++k) place(k);
    for (std::int32_t k = row.chunks; k < row.chunks + row.after; ++k) place(k);
    start += row_width(row);
  }
}

/// Gradients of n chunks that place_rows has found, in the lanes of a batch.
template <int D>
void LatticeModel<D>::gradients_of_rows(const std::int32_t* index, int n, ConstFieldView u, double* H) const noexcept {
  for (int i = 0, next = 1; i < n; i = next++) {
    while (next < n && index[next] == index[next - 1] + 1) ++next;
    operator_.gradient(&families_.chunks[static_cast<std::size_t>(index[i])], next - i, u, H + i * chunk_points, batch_points);
  }
}

/// Gradient, law and divergence of a block, a few rows at a time: Q stays in the nearest caches.
template <int D>
void LatticeModel<D>::rows_block(std::size_t b, Pass& pass) {
  const LatticeBlock& block = families_.blocks[b];
  BatchScratch& s = scratch_.begin_block(b);
  RowScratch& r = row_scratch_[static_cast<std::size_t>(thread_index())];
  double energy = 0, of_others = 0;
  std::size_t chunk = block.chunk_begin;
  for (std::size_t first = block.row_begin; first < block.row_end;) {
    const std::span rows = std::span(families_.rows).subspan(first, std::min(block.row_end - first, rows_at_once(families_.rows[first])));
    place_rows(rows, chunk, block.chunk_end, r);
    for (std::size_t i = 0; i < r.index.size();) {
      const bool own = i < r.own;
      const int n = static_cast<int>(std::min<std::size_t>(slots_at_once, (own ? r.own : r.index.size()) - i));
      gradients_of_rows(&r.index[i], n, pass.u, s.H);
      if (pass.work.tangent()) gradients_of_rows(&r.index[i], n, pass.w, s.dH);
      const std::int64_t bad = evaluate_chunks(&r.index[i], n, s, pass, own ? &energy : &of_others);
      if (bad >= 0) {
        pass.report(bad);
        return;
      }
      for (int k = 0; k < n; ++k, ++i)
        operator_.stress_to_flux(families_.chunks[static_cast<std::size_t>(r.index[i])], s.P + k * chunk_points, batch_points, r.flux, r.at[i], own ? pass.out : FieldView{});
    }
    std::int64_t start = row_gap_;
    for (const LatticeRow& row : rows) {
      operator_.divergence(row, r.flux, start, pass.out);
      start += row_width(row);
    }
    for (std::size_t i = 0; i < r.own && families_.broken > 0; ++i)
      operator_.remove_broken(families_.chunks[static_cast<std::size_t>(r.index[i])], r.flux, r.at[i], {}, pass.out);
    first += rows.size();
  }
  if (pass.energies) pass.energies[b] = energy;
}

template <int D>
void LatticeModel<D>::gradient_block(std::size_t b, Pass& pass) {
  const LatticeBlock& block = families_.blocks[b];
  const bool tangent = pass.work.tangent();
  if (!pass.alone()) {
    zero_rows(block, pass.out);
    zero_rows(block, flux_);
    if (formulation_.selective()) zero_rows(block, pressure_);
  }
  for (std::size_t c = block.chunk_begin; c < block.chunk_end;) {
    if (!pass.gradient_wanted(families_.chunks[c].first)) {
      ++c;
      continue;
    }
    const int n = stencils_ || pass.near ? 1 : run_length(families_.chunks, c, block.chunk_end, 4);
    const LatticeChunk& chunk = families_.chunks[c];
    if (stencils_) {
      stencils_->gradient(chunk, pass.u, gradient_);
      if (tangent) stencils_->gradient(chunk, pass.w, direction_);
    } else {
      operator_.gradient(&chunk, n, pass.u, gradient_.data() + chunk.first, gradient_.stride());
      if (tangent) operator_.gradient(&chunk, n, pass.w, direction_.data() + chunk.first, direction_.stride());
    }
    c += static_cast<std::size_t>(n);
  }
  for (std::size_t c = block.chunk_begin; c < block.chunk_end && formulation_.selective(); ++c) {
    if (!pass.gradient_wanted(families_.chunks[c].first)) continue;
    owner_volume(laws_.space(), owner_gradients(families_.chunks[c], tangent), volume_.data() + families_.chunks[c].first, volume_.stride());
  }
}

template <int D>
OwnerGradients LatticeModel<D>::owner_gradients(const LatticeChunk& chunk, bool tangent) const noexcept {
  return {chunk_points, gradient_.stride(), gradient_.data() + chunk.first, tangent ? direction_.data() + chunk.first : nullptr};
}

/// Volume changes of the owners, and those of the far ends after them.
template <int D>
void LatticeModel<D>::point_to_volumes(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s) const noexcept {
  s.owner_volumes = {volume_.data(), volume_.stride(), s.volume_group, families_.singular == 0 && families_.failed == 0};
  std::fill_n(s.volume_group, slots, chunk.first);
  for (int k = 0; k < slots && pairs_; ++k) s.volume_group[slots + k] = chunk.first + families_.shifts[slot + static_cast<std::size_t>(k)];
}

template <int D>
void LatticeModel<D>::add_pressures(const LatticeChunk& chunk, std::size_t slot, int slots, const BatchScratch& s, bool both_ends, bool tangent) noexcept {
  const LatticePattern& pattern = families_.pattern(chunk);
  for (int c = 0; c < (tangent ? 2 : 1); ++c) {
    const double* from = c == 0 ? s.pressure : s.pressure_rate;
    double* to = pressure_.component(c) + chunk.first;
    for (int l = 0; l < chunk_points; l += pack_width) {
      Pack own = Pack::load(to + l);
      for (int k = 0; k < slots; ++k) own += Pack::load(from + k * chunk_points + l);
      own.store(to + l);
      for (int k = 0; k < slots && both_ends; ++k) {
        const std::size_t at = slot + static_cast<std::size_t>(k);
        add_to_cells(to + families_.shifts[at] + l, Pack::load(from + (slots + k) * chunk_points + l), pack_mask(pattern.mask[at], l));
      }
    }
  }
}

template <int D>
void LatticeModel<D>::bond_vectors(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, BondVectors& vectors) const {
  if (chunk.pattern < 0 || formulation_.g_from_xi_only) {
    vectors.per_slot = true;
    for (int c = 0; c < D; ++c) {
      vectors.xi[c] = slot_xi_[c].data() + slot;
      vectors.g[c] = slot_g_[c].data() + slot;
    }
    return;
  }
  if (static_cast<std::size_t>(chunk.pattern) < pattern_g_.size()) {
    vectors.per_slot = false;
    const std::size_t first = slot / slots_at_once * D * batch_points + slot % slots_at_once * chunk_points;
    for (std::size_t c = 0; c < D; ++c) {
      vectors.xi[c] = lane_xi_.data() + first + c * batch_points;
      vectors.g[c] = pattern_g_[static_cast<std::size_t>(chunk.pattern)].data() + first + c * batch_points;
    }
    return;
  }
  // The correction depends on the family: ask for each lane.
  const LatticePattern& pattern = families_.pattern(chunk);
  double* xi = s.bond[0];
  double* g = s.bond[1];
  double* length = s.bond[2];
  double* omega = s.bond[2] + batch_points;
  double* volume = s.bond[2] + 2 * batch_points;
  alignas(64) double inverse[6 * batch_points];
  const int lanes = slots * chunk_points;
  for (int l = 0; l < lanes; ++l) {
    const std::size_t k = slot + static_cast<std::size_t>(l / chunk_points);
    double r2 = 0;
    for (int c = 0; c < D; ++c) {
      xi[c * batch_points + l] = slot_xi_[c][k];
      r2 += slot_xi_[c][k] * slot_xi_[c][k];
    }
    length[l] = std::sqrt(r2);
    const bool intact = LatticeFamilies::intact(pattern, k, l % chunk_points);
    omega[l] = intact ? families_.omega[k] : 0.0;
    volume[l] = intact ? families_.volume : 0.0;
    double own[6];
    families_.inverse_shape(pattern, l % chunk_points, own);
    for (int e = 0; e < symmetric_components(D); ++e) inverse[e * batch_points + l] = own[e];
  }
  const FamilyView view{D, lanes, body_.horizon(), {xi, xi + batch_points, xi + 2 * batch_points}, length, volume, omega, inverse, batch_points};
  formulation_.bond->correction(view, g, batch_points);
  vectors.per_slot = false;
  for (int c = 0; c < D; ++c) {
    vectors.xi[c] = xi + c * batch_points;
    vectors.g[c] = g + c * batch_points;
  }
}

template <int D>
int LatticeModel<D>::bonds_of_chunk(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, Pass& pass, double* energy) {
  const LatticePattern& pattern = families_.pattern(chunk);
  const LaneFactors& factors = lane_factors();
  const bool mean = formulation_.base == BondBase::mean, tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample;
  const bool both_ends = pairs_ && !pass.alone();
  const std::int64_t p = chunk.first;
  double* const H = formulation_.selective() ? s.Ht : s.H;
  double* const dH = formulation_.selective() ? s.dHt : s.dH;
  if (formulation_.selective()) point_to_volumes(chunk, slot, slots, s);
  BondVectors vectors;
  bond_vectors(chunk, slot, slots, s, vectors);
  const int lanes = slots * chunk_points;
  const std::int64_t* shifts = families_.shifts.data() + slot;
  const auto gradient = [&](auto per_slot, auto of_both, ConstFieldView u, ConstFieldView Hbar, double* H) {
    lattice_bond_gradient<D, per_slot.value, of_both.value>(shifts, slots, p, vectors, u, Hbar, H);
  };
  const auto adjoint = [&](auto per_slot, auto of_both) {
    lattice_bond_adjoint<D, per_slot.value, of_both.value>(shifts, pattern.mask.data() + slot, slots, p, vectors, s.P, pass.out, flux_);
  };
  // The kernels are compiled for each way of reading the bond vectors and each base.
  const auto choose = [&](const auto& kernel, auto... arguments) {
    using std::false_type, std::true_type;
    if (vectors.per_slot) mean ? kernel(true_type(), true_type(), arguments...) : kernel(true_type(), false_type(), arguments...);
    else mean ? kernel(false_type(), true_type(), arguments...) : kernel(false_type(), false_type(), arguments...);
  };
  choose(gradient, pass.u, ConstFieldView(gradient_), H);
  if (tangent) choose(gradient, pass.w, ConstFieldView(direction_), dH);
  for (int k = 0; k < slots; ++k) {
    const std::size_t at = slot + static_cast<std::size_t>(k);
    const std::int64_t shift = families_.shifts[at];
    const std::uint8_t mask = pattern.mask[at];
    for (int l = 0; l < chunk_points; l += pack_width) {
      const int lane = k * chunk_points + l;
      const Pack exists = Pack::load(factors.value[mask] + l) * Pack(slot_weight_[at]);
      (exists * Pack::load(pattern.scale + l)).store(s.weight + lane);
      if (both_ends) (exists * Pack::load(scale_.data() + p + shift + l)).store(s.far_weight + lane);
      if (mask == 0xff) continue;
      const Pack keep = Pack::load(factors.value[mask] + l);
      for (int c = 0; c < D * D; ++c) {
        (keep * Pack::load(H + c * batch_points + lane)).store(H + c * batch_points + lane);
        if (tangent) (keep * Pack::load(dH + c * batch_points + lane)).store(dH + c * batch_points + lane);
      }
    }
    if (!laws_.single() || sample) {
      for (int l = 0; l < chunk_points; ++l) {
        s.owner[k * chunk_points + l] = chunk.first + l;
        s.far[k * chunk_points + l] = static_cast<std::int32_t>((mask >> l & 1) ? p + shift + l : p + l);
      }
    }
  }
  const int bad = pass.work.evaluate(lanes, s, both_ends, energy);
  if (bad >= 0) return bad;
  if (sample) {
    pass.work.add_samples(lanes, s, *pass.sums);
    return -1;
  }
  if (pass.only) return -1;
  choose(adjoint);
  if (formulation_.selective()) add_pressures(chunk, slot, slots, s, both_ends, tangent);
  return -1;
}

template <int D>
void LatticeModel<D>::bonds_block(std::size_t b, Pass& pass) {
  const LatticeBlock& block = families_.blocks[b];
  BatchScratch& s = scratch_.begin_block(b);
  const std::size_t slots = pairs_ && !pass.alone() ? families_.half : families_.offsets.size();
  double energy = 0;
  for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
    const LatticeChunk& chunk = families_.chunks[c];
    if (!pass.wanted(chunk.first)) continue;
    for (std::size_t slot = 0; slot < slots; slot += static_cast<std::size_t>(slots_at_once_)) {
      const int n = static_cast<int>(std::min(static_cast<std::size_t>(slots_at_once_), slots - slot));
      const int bad = bonds_of_chunk(chunk, slot, n, s, pass, &energy);
      if (bad >= 0) {
        pass.report(chunk.first + bad % chunk_points);
        return;
      }
    }
  }
  if (pass.energies) pass.energies[b] = energy;
}

/// What is left to do with the stress on Hbar once all bonds are in.
template <int D>
void LatticeModel<D>::finish_stress(std::size_t b, Pass& pass) {
  for (std::size_t c = families_.blocks[b].chunk_begin; c < families_.blocks[b].chunk_end; ++c) {
    const LatticeChunk& chunk = families_.chunks[c];
    double* const stress = flux_.data() + chunk.first;
    if (formulation_.selective()) {
      add_owner_stress(laws_.space(), owner_gradients(chunk, pass.work.tangent()), pressure_.component(0) + chunk.first, pressure_.component(1) + chunk.first,
                       stress, flux_.stride());
    }
    if (!stencils_) operator_.stress_to_flux(chunk, stress, flux_.stride(), flux_, chunk.first, pass.out);
  }
}

/// Bonds: adds the adjoint of the point gradient, as pass `number`: of Q, or of the stress on Hbar for stored stencils.
template <int D>
void LatticeModel<D>::divergence(Pass& pass, int number) const {
  const auto chunks_of = [&](std::size_t b, auto&& each) {
    if (!quiet_.awake(b, number)) return;
    for (std::size_t c = families_.blocks[b].chunk_begin; c < families_.blocks[b].chunk_end; ++c) each(families_.chunks[c]);
  };
  if (stencils_) {
    families_.colouring.for_each([&](std::size_t b) { chunks_of(b, [&](const LatticeChunk& chunk) { stencils_->adjoint(chunk, flux_, pass.out); }); });
    return;
  }
  families_.colouring.for_each([&](std::size_t b) {
    if (!quiet_.awake(b, number)) return;
    for (std::size_t r = families_.blocks[b].row_begin; r < families_.blocks[b].row_end; ++r)
      operator_.divergence(families_.rows[r], flux_, families_.rows[r].first, pass.out);
    if (families_.broken > 0) chunks_of(b, [&](const LatticeChunk& chunk) { operator_.remove_broken(chunk, flux_, chunk.first, {}, pass.out); });
  });
}

template <int D>
void LatticeModel<D>::clean(FieldView out) const noexcept {
  for (const auto& [first, live] : partly_dead_)
    for (int c = 0; c < out.components; ++c)
      for (int l = 0; l < chunk_points; ++l)
        if (!(live >> l & 1)) out.component(c)[first + l] = 0.0;
}

template <int D>
EvaluationStatus LatticeModel<D>::run(Pass& pass) {
  scratch_.prepare(laws_);
  const std::size_t blocks = families_.blocks.size();
  const bool alone = pass.alone(), points = formulation_.point != nullptr;
  const int last = points ? 2 : 3;
  if (alone || pass.work.tangent()) quiet_.wake();
  else quiet_.look(last, [&](std::size_t b) { return families_.moves(b, pass.u); });
  const auto awake = [&](int number, auto&& block) { return [&, number](std::size_t b) { if (quiet_.awake(b, number)) block(b); }; };
  if (points && alone) {
    parallel_for(blocks, [&](std::size_t b) { points_block(b, pass); });
  } else if (points) {
    row_scratch_.resize(static_cast<std::size_t>(thread_count()));
    for (RowScratch& r : row_scratch_)
      if (r.flux.size() == 0) r.flux = Field(D * D, padded(static_cast<std::size_t>(most_cells_)));
    parallel_for(blocks, [&](std::size_t b) { zero_rows(families_.blocks[b], pass.out); });
    families_.colouring.for_each(awake(1, [&](std::size_t b) { rows_block(b, pass); }));
  } else {
    parallel_for(blocks, [&](std::size_t b) { quiet_.begins(b) ? gradient_block(b, pass) : zero_rows(families_.blocks[b], pass.out); });
    if (alone) {
      parallel_for(blocks, [&](std::size_t b) { bonds_block(b, pass); });
    } else {
      families_.colouring.for_each(awake(2, [&](std::size_t b) { bonds_block(b, pass); }));
      parallel_for(blocks, awake(2, [&](std::size_t b) { finish_stress(b, pass); }));
      if (pass.bad < 0) divergence(pass, last);
    }
  }
  if (pass.bad >= 0 || alone) return status_at(body_, pass.bad);
  clean(pass.out);
  return {};
}

template <int D>
EvaluationStatus LatticeModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  return run_forces(laws_, formulation_.selective(), families_.blocks.size(), u, force, energy, [&](Pass& pass) { return run(pass); });
}

template <int D>
EvaluationStatus LatticeModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  if (formulation_.bond && direction_.size() == 0) direction_ = body_.make_field(D * D);
  const BatchWork work(laws_, Work::tangent, false, formulation_.selective());
  Pass pass{work, u, w, Kw, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
EvaluationStatus LatticeModel<D>::sample(ConstFieldView u, PointSamples& samples) {
  return run_samples(body_, laws_, formulation_.selective(), u, samples, [&](Pass& pass) { return run(pass); });
}

template <int D>
std::vector<BondChange> LatticeModel<D>::bonds_changed(std::span<const std::int32_t> points) {
  for (const std::int32_t p : points)
    if (formulation_.selective())
      volume_.component(volume_share)[p] = share_of_volume(families_.chunks[static_cast<std::size_t>(families_.chunk_of(p))], p % chunk_points);
  return families_.fragment_bonds(points);
}

template <int D>
double LatticeModel<D>::energy_of(ConstFieldView u, const GroupMarks& marks) {
  return run_energy(body_, laws_, formulation_.selective(), families_.blocks.size(), u, marks, *bonds_,
                    [&](Pass& pass) { return run(pass); });
}

template <int D>
Field LatticeModel<D>::shape_tensor_condition() {
  Field out = body_.make_field(1);
  for (const LatticeChunk& chunk : families_.chunks) std::copy_n(families_.pattern(chunk).condition, chunk_points, out.data() + chunk.first);
  return out;
}

template <int D>
Field LatticeModel<D>::damage() {
  Field out = body_.make_field(1);
  for (const LatticeChunk& chunk : families_.chunks) std::copy_n(families_.pattern(chunk).damage, chunk_points, out.data() + chunk.first);
  return out;
}

template <int D>
ModelReport LatticeModel<D>::report() const {
  ModelReport report;
  report.bonds = families_.bonds;
  report.broken_bonds = families_.broken - families_.failed;
  report.singular_families = families_.singular;
  report.fallbacks = stencils_ ? stencils_->fallbacks() : 0;
  std::size_t row_bytes = 0;
  for (const RowScratch& r : row_scratch_) row_bytes += r.flux.bytes();
  report.bytes = families_.bytes() + (stencils_ ? stencils_->bytes() : 0) + row_bytes + flux_.bytes() + gradient_.bytes() +
                 direction_.bytes() + scale_.bytes() + volume_.bytes() + pressure_.bytes() + scratch_.bytes() +
                 (pattern_g_.size() + 1) * lane_xi_.size() * sizeof(double) + this->fracture_bytes();
  const bool bonds = formulation_.bond != nullptr;
  report.evaluation_points = bonds ? (pairs_ ? families_.bonds / 2 : families_.bonds) : body_.points();
  const double per_bond = static_cast<double>(families_.bonds);
  report.skips.push_back({"neighbour lists and bond vectors", "lattice: neighbours lie at fixed shifts",
                          fmt::format("{:.3g} MB", per_bond * (4 + 8 * (D + 1)) / 1e6)});
  std::size_t whole = 0;
  for (const LatticeChunk& chunk : families_.chunks) whole += chunk.pattern < 0;
  report.skips.push_back({"shape tensors of whole families", fmt::format("one for {} of {} chunks, {} patterns for the rest", whole, families_.chunks.size(), families_.patterns.size()),
                          fmt::format("{:.3g} MB", (static_cast<double>(families_.chunks.size()) - static_cast<double>(families_.patterns.size())) * sizeof(LatticePattern) / 1e6)});
  if (pairs_) {
    report.skips.push_back({"second evaluation of each bond", "the gradient is the same for ij and ji", fmt::format("{} of {} evaluations", families_.bonds / 2, families_.bonds)});
  }
  if (D < 3) report.skips.push_back({"components outside the space", fmt::format("{}D kernels", D), fmt::format("{} of 9 gradient components", 9 - D * D)});
  return report;
}

template class LatticeModel<1>;
template class LatticeModel<2>;
template class LatticeModel<3>;

}  // namespace perikit
