#include "spaces/lattice/lattice_points.hpp"

#include <algorithm>
#include <cstring>

namespace perikit {

namespace {

/// Chunks of a batch: batch_points lanes.
constexpr int chunks_at_once = batch_points / chunk_points;

/// Rows of a block that are taken together: whole batches for the law where rows are short.
std::size_t rows_at_once(const LatticeRow& row) noexcept { return static_cast<std::size_t>(std::max(1, chunks_at_once / row.chunks)); }

}  // namespace

template <int D>
LatticePoints<D>::LatticePoints(const SpaceParts& parts)
    : families_(*parts.families.lattice()),
      tiles_(families_.tiles),
      laws_(parts.laws),
      roles_(families_, laws_),
      operator_(families_) {
  quiet_ = parts.quiet_blocks(tiles_.reach);
  gap_ = static_cast<std::int64_t>(padded(static_cast<std::size_t>(families_.slots.row_reach)));
  for (const LatticeRow& row : tiles_.rows) most_ = std::max(most_, static_cast<std::int64_t>(rows_at_once(row)) * width(row));
}

/// The law of n chunks, whose gradients are in the lanes of s. Whether all of them are admissible.
template <int D>
bool LatticePoints<D>::evaluate(const std::int32_t* index, int n, BatchScratch& s, Pass& pass, GroupEnergy* energy) const {
  s.one_law = roles_.law_of(index[0]);
  for (int i = 0; i < n; ++i)
    if (roles_.law_of(index[i]) != s.one_law || pass.work.laminates_near(chunk(index[i]).first)) s.one_law = ChunkRole::mixed;
  for (int i = 0; i < n; ++i) {
    const int lane = i * chunk_points;
    const LatticePattern& pattern = families_.pattern(chunk(index[i]));
    std::memcpy(s.weight + lane, pattern.weight, sizeof families_.whole.weight);
    // A point without bonds shows its own values, and its history is part of the state that a run goes on from.
    for (int l = 0; l < chunk_points && pass.work.work() == Work::sample; ++l)
      if (s.weight[lane + l] == 0 && (pattern.live >> l & 1)) s.weight[lane + l] = 1e-300;
    if ((!laws_.single() && s.one_law < 0) || pass.gathers_only() || pass.work.wants_ends()) {
      for (int l = 0; l < chunk_points; ++l) {
        s.owner[lane + l] = chunk(index[i]).first + l;
        s.far[lane + l] = -1;
      }
    }
  }
  if (pass.work.numbered()) {
    s.first_number = index[n - 1] - index[0] == n - 1 ? std::int64_t{index[0]} * chunk_points : -1;
    for (int l = 0; l < n * chunk_points; ++l) s.number[l] = std::int64_t{index[l / chunk_points]} * chunk_points + l % chunk_points;
  }
  const int bad = pass.work.evaluate(n * chunk_points, s, false, energy);
  if (bad >= 0) pass.report(chunk(index[bad / chunk_points]).first + bad % chunk_points);
  for (int i = 0; i < n && s.keep_history; ++i) pass.work.screen(chunk(index[i]).first, i * chunk_points, chunk_points, s);
  return bad < 0;
}

/// Energies or samples of points, one by one.
template <int D>
void LatticePoints<D>::one_by_one(std::size_t b, Pass& pass) {
  const LatticeBlock& block = tiles_.blocks[b];
  BatchScratch& s = scratch_.mine();
  GroupEnergy energy;
  std::int32_t index[chunks_at_once];
  int n = 0;
  for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
    if (pass.wanted(tiles_.chunks[c].first)) {
      operator_.gradient(&tiles_.chunks[c], 1, pass.u, s.H + n * chunk_points, batch_points);
      index[n++] = static_cast<std::int32_t>(c);
    }
    if (n == 0 || (n < chunks_at_once && c + 1 < block.chunk_end)) continue;
    if (!evaluate(index, n, s, pass, &energy)) return;
    if (pass.work.work() == Work::sample) pass.add_samples(n * chunk_points, s);
    n = 0;
  }
  if (pass.energies && block.chunk_begin < block.chunk_end) pass.energies[tiles_.first_group(b)] = energy;
}

/// Cells of a row in the memory of Q: with a gap before it and after it, zero, or Q of the chunks that families reach there.
template <int D>
std::int64_t LatticePoints<D>::width(const LatticeRow& row) const noexcept {
  return std::int64_t(row.chunks) * chunk_points + 2 * gap_;
}

/// Whether a chunk of a row, or one beyond its ends that it reads, is wanted; true of rows without points.
template <int D>
bool LatticePoints<D>::wanted(const LatticeRow& row, const Pass& pass) const noexcept {
  if (!pass.only) return true;
  bool any = false;
  for (std::int32_t k = -row.before; k < row.chunks + row.after; ++k) {
    const std::int32_t index = tiles_.chunk_of(row.first + k * chunk_points);
    if (index < 0) continue;
    if (pass.wanted(chunk(index).first)) return true;
    any = true;
  }
  return !any;
}

/// Rows from `first` on that are taken together, and `first` is what comes after them. Those that nobody feels or wants are left
/// out one by one: what is evaluated may not depend on how many rows of a block a rank has.
template <int D>
std::span<const LatticeRow> LatticePoints<D>::rows_from(std::size_t& first, std::size_t end, const Pass& pass) const {
  const auto taken = [&](std::size_t r) { return roles_.wants_row(r) && wanted(tiles_.rows[r], pass); };
  while (first < end && !taken(first)) ++first;
  const std::size_t begin = first, last = first < end ? std::min(end, first + rows_at_once(tiles_.rows[first])) : end;
  while (first < last && taken(first)) ++first;
  return std::span(tiles_.rows).subspan(begin, first - begin);
}

/// Zero before, between and behind the chunks that `place` has listed, as far as `end`.
template <int D>
void LatticePoints<D>::clear_gaps(std::int64_t end, Rows& r) const noexcept {
  std::int64_t from = 0;
  const auto zero = [&](std::int64_t to) {
    for (int c = 0; c < D * D && to > from; ++c) std::memset(r.flux.component(c) + from, 0, sizeof(double) * static_cast<std::size_t>(to - from));
  };
  for (const std::int64_t at : r.at) {
    zero(at);
    from = at + chunk_points;
  }
  zero(end);
}

/// Where Q of the live chunks of rows that follow each other goes; `next` is the first chunk of the rows, and then the one after
/// their last.
template <int D>
void LatticePoints<D>::place(std::span<const LatticeRow> rows, std::size_t& next, std::size_t end, Rows& r) const {
  r.index.clear();
  r.at.clear();
  bool alike = true;  // whole rows of so many chunks
  std::int64_t start = gap_;
  for (const LatticeRow& row : rows) {
    while (next < end && tiles_.chunks[next].first < row.first) ++next;  // of rows that were left out
    for (; next < end && row.holds(tiles_.chunks[next].first); ++next) {
      r.index.push_back(static_cast<std::int32_t>(next));
      r.at.push_back(start + tiles_.chunks[next].first - row.first);
    }
    start += width(row);
    alike = alike && row.chunks == rows.front().chunks && row.before == 0 && row.after == 0;
  }
  r.own = r.index.size();
  const std::int32_t chunks = alike && !rows.empty() && r.own == rows.size() * static_cast<std::size_t>(rows.front().chunks) ? rows.front().chunks : 0;
  if (chunks == 0 || chunks != r.clear_between) r.clear_to = 0;
  r.clear_between = chunks;
  if (r.clear_to < start - gap_) clear_gaps(start - gap_, r);
  r.clear_to = std::max(r.clear_to, start - gap_);
  // Where a row goes on in another block, families reach into Q of its chunks: computed here, too.
  start = gap_;
  for (const LatticeRow& row : rows) {
    const auto outside = [&](std::int32_t k) {
      const std::int32_t index = tiles_.chunk_of(row.first + k * chunk_points);
      if (index < 0) return;
      r.index.push_back(index);
      r.at.push_back(start + k * chunk_points);
    };
    for (std::int32_t k = -row.before; k < 0; ++k) outside(k);
    for (std::int32_t k = row.chunks; k < row.chunks + row.after; ++k) outside(k);
    start += width(row);
  }
}

/// Gradients of n chunks that `place` has found, in the lanes of a batch.
template <int D>
void LatticePoints<D>::gradients(const std::int32_t* index, int n, ConstFieldView u, double* H) const noexcept {
  for (int i = 0, next = 1; i < n; i = next++) {
    while (next < n && index[next] == index[next - 1] + 1) ++next;
    operator_.gradient(&chunk(index[i]), next - i, u, H + i * chunk_points, batch_points);
  }
}

template <int D>
void LatticePoints<D>::by_rows(std::size_t b, Pass& pass) {
  const LatticeBlock& block = tiles_.blocks[b];
  BatchScratch& s = scratch_.mine();
  Rows& r = rows_[static_cast<std::size_t>(thread_index())];
  GroupEnergy energy, of_others;
  std::size_t next = block.chunk_begin;
  for (std::size_t first = block.row_begin; first < block.row_end;) {
    const std::span<const LatticeRow> rows = rows_from(first, block.row_end, pass);
    place(rows, next, block.chunk_end, r);
    for (std::size_t i = 0; i < r.index.size();) {
      const bool own = i < r.own;
      const int n = static_cast<int>(std::min<std::size_t>(chunks_at_once, (own ? r.own : r.index.size()) - i));
      gradients(&r.index[i], n, pass.u, s.H);
      if (pass.work.tangent()) gradients(&r.index[i], n, pass.w, s.dH);
      s.keep_history = own;
      if (!evaluate(&r.index[i], n, s, pass, own ? &energy : &of_others)) return;
      for (int k = 0; k < n; ++k, ++i) {
        const double* const weight = s.stress_weight ? s.stress_weight + k * chunk_points : nullptr;
        operator_.stress_to_flux(chunk(r.index[i]), s.P + k * chunk_points, batch_points, r.flux, r.at[i], weight);
      }
    }
    // Row by row, so that the order of sums does not depend on how many rows are taken together: a rank may have a part of the block.
    std::int64_t start = gap_;
    std::size_t end = 0;
    for (const LatticeRow& row : rows) {
      const std::size_t begin = end;
      for (; end < r.own && row.holds(chunk(r.index[end]).first); ++end) operator_.own_flux(chunk(r.index[end]), r.flux, r.at[end], pass.out);
      operator_.divergence(row, r.flux, start, pass.out);
      for (std::size_t i = begin; i < end && families_.any_broken(); ++i) operator_.remove_broken(chunk(r.index[i]), r.flux, r.at[i], {}, pass.out);
      start += width(row);
    }
  }
  s.keep_history = true;
  if (pass.energies && block.chunk_begin < block.chunk_end) pass.energies[tiles_.first_group(b)] = energy;
}

template <int D>
void LatticePoints<D>::run(Pass& pass) {
  scratch_.prepare(laws_, pass.work.laminates());
  if (pass.everywhere())
    quiet_.wake();
  else
    quiet_.look(
        2, [&](std::size_t b) { return tiles_.moves(b, pass.u); }, pass.arrival, pass.motion);
  if (pass.gathers_only()) return parallel_for(blocks(), [&](std::size_t b) { one_by_one(b, pass); });
  rows_.resize(static_cast<std::size_t>(thread_count()));
  for (Rows& r : rows_)
    if (r.flux.size() == 0) r.flux = Field(D * D, padded(static_cast<std::size_t>(most_)));
  tiles_.colouring.for_each(
      [&](std::size_t b) {
        if (!quiet_.awake(b, 1)) return;
        if (pass.motion) pass.motion->need(tiles_.pieces(b));
        by_rows(b, pass);
      },
      pass.arrival);
  if (pass.motion) pass.motion->finish();   // what no block reads
  tiles_.clear_dead(pass.out);
}

template <int D>
void LatticePoints<D>::report(ModelReport& report) const {
  report.evaluation_points += families_.body().points();
  for (const Rows& r : rows_) report.bytes += r.flux.bytes();
  report.bytes += scratch_.bytes();
}

template class LatticePoints<1>;
template class LatticePoints<2>;
template class LatticePoints<3>;

}  // namespace perikit
