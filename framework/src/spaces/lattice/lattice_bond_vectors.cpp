/// The vectors xi and g of the bonds of a lattice: once for all whole families, by pattern, or computed where they are needed.

#include <algorithm>
#include <cmath>

#include "families/shape_tensor.hpp"
#include "spaces/lattice/lattice_bonds.hpp"

namespace perikit {

namespace {

constexpr int slots_at_once = batch_points / chunk_points;
/// Corrections of families that are not whole are stored by pattern up to this many bytes, else computed when needed.
constexpr std::size_t stored_corrections = std::size_t{64} << 20;

}  // namespace

/// Bonds of whole families: one vector per slot, from one call on the whole family.
template <int D>
void LatticeBonds<D>::set_whole_vectors() {
  const LatticeSlots& all = families_.slots;
  std::vector<std::uint16_t> of(all.size());
  for (std::size_t s = 0; s < of.size(); ++s) of[s] = static_cast<std::uint16_t>(s);
  FamilyArrays family;
  families_.load(of, family);
  families_.inverse_shape(families_.whole, 0, family.inverse_shape);
  std::vector<double> g(family.size * D);
  formulation_.bond->correction(family.view(families_.body().horizon()), g.data(), family.size);
  for (std::size_t c = 0; c < D; ++c) {
    slot_xi_[c].assign(family.xi[c].begin(), family.xi[c].end());
    slot_g_[c].assign(g.begin() + static_cast<std::ptrdiff_t>(c * family.size), g.begin() + static_cast<std::ptrdiff_t>((c + 1) * family.size));
  }
  for (std::size_t s = 0; s < all.size(); ++s)
    slot_weight_.push_back(families_.volume * (formulation_.weight == BondWeight::kernel ? all.omega[s] : 1.0));
}

template <int D>
void LatticeBonds<D>::store_corrections() {
  const std::size_t slots = families_.slots.size(), groups = (slots + slots_at_once - 1) / slots_at_once, size = groups * D * batch_points;
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
void LatticeBonds<D>::bond_vectors(const LatticeChunk& chunk, std::size_t slot, int slots, BatchScratch& s, BondVectors& vectors) const {
  if (chunk.pattern < 0 || formulation_.g_from_xi_only) {
    vectors.per_slot = true;
    for (int c = 0; c < D; ++c) {
      vectors.xi[c] = slot_xi_[c].data() + slot;
      vectors.g[c] = slot_g_[c].data() + slot;
    }
    return;
  }
  vectors.per_slot = false;
  if (static_cast<std::size_t>(chunk.pattern) < pattern_g_.size()) {
    const std::size_t first = slot / slots_at_once * D * batch_points + slot % slots_at_once * chunk_points;
    for (std::size_t c = 0; c < D; ++c) {
      vectors.xi[c] = lane_xi_.data() + first + c * batch_points;
      vectors.g[c] = pattern_g_[static_cast<std::size_t>(chunk.pattern)].data() + first + c * batch_points;
    }
    return;
  }
  // The correction depends on the family: ask for each lane.
  const LatticePattern& pattern = families_.pattern(chunk);
  double *xi = s.bond[0], *g = s.bond[1], *length = s.bond[2], *omega = s.bond[2] + batch_points, *volume = s.bond[2] + 2 * batch_points;
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
    const double b = pattern.b(k, l % chunk_points);
    omega[l] = b * families_.slots.omega[k];
    volume[l] = b > 0 ? families_.volume : 0.0;
    double own[6];
    families_.inverse_shape(pattern, l % chunk_points, own);
    for (int e = 0; e < symmetric_components(D); ++e) inverse[e * batch_points + l] = own[e];
  }
  const FamilyView view{D, lanes, families_.body().horizon(), {xi, xi + batch_points, xi + 2 * batch_points}, length, volume, omega, inverse, batch_points};
  formulation_.bond->correction(view, g, batch_points);
  for (int c = 0; c < D; ++c) {
    vectors.xi[c] = xi + c * batch_points;
    vectors.g[c] = g + c * batch_points;
  }
}

#define PERIKIT_INSTANTIATE(D)                            \
  template void LatticeBonds<D>::set_whole_vectors();     \
  template void LatticeBonds<D>::store_corrections();     \
  template void LatticeBonds<D>::bond_vectors(const LatticeChunk&, std::size_t, int, BatchScratch&, BondVectors&) const;
PERIKIT_INSTANTIATE(1)
PERIKIT_INSTANTIATE(2)
PERIKIT_INSTANTIATE(3)
#undef PERIKIT_INSTANTIATE

}  // namespace perikit
