#include "spaces/lattice/lattice_stencils.hpp"

#include "perikit/core/parallel.hpp"
#include "spaces/bond_shape.hpp"

namespace perikit {

template <int D>
LatticeStencils<D>::LatticeStencils(const LatticeFamilies& families, int order)
    : f_(families), order_(order), stencil_size_(families.slots.size() * D * chunk_points), g_((families.patterns.size() + 1) * stencil_size_, 0.0) {
  std::vector<const LatticeChunk*> example(f_.patterns.size() + 1, nullptr);
  std::vector<std::size_t> members(example.size(), 0), lower(example.size(), 0);
  for (const LatticeChunk& chunk : f_.tiles.chunks) {
    const auto k = static_cast<std::size_t>(chunk.pattern + 1);
    example[k] = &chunk;
    ++members[k];
  }
  parallel_for(example.size(), [&](std::size_t k) {
    if (example[k]) lower[k] = make(*example[k]);
  });
  for (std::size_t k = 0; k < lower.size(); ++k) fallbacks_ += lower[k] * members[k];
}

template <int D>
void LatticeStencils<D>::renew(const LatticeChunk& chunk) {
  g_.resize((f_.patterns.size() + 1) * stencil_size_);
  std::fill_n(g_.begin() + static_cast<std::ptrdiff_t>(place(chunk)), stencil_size_, 0.0);
  make(chunk);
}

template <int D>
std::size_t LatticeStencils<D>::make(const LatticeChunk& chunk) {
  double* const stored = g_.data() + place(chunk);
  FamilyArrays family;
  std::vector<double> g;
  std::size_t lower = 0;
  for (std::size_t l = 0; l < chunk_points; ++l) {
    if (!(f_.pattern(chunk).live >> l & 1)) continue;
    const auto p = static_cast<std::size_t>(chunk.first) + l;
    f_.load(p, BondsOf::intact, family);
    lower += point_gradient(family, f_.body().horizon(), order_, g) < order_;
    for (std::size_t k = 0; k < family.far.size(); ++k) {
      const std::size_t slot = f_.slots.with_shift(family.far[k] - static_cast<std::int64_t>(p));
      for (std::size_t e = 0; e < D; ++e) stored[(slot * D + e) * chunk_points + l] = g[k * D + e];
    }
  }
  return lower;
}

template <int D>
void LatticeStencils<D>::gradient(const LatticeChunk& chunk, ConstFieldView u, FieldView H) const noexcept {
  const double* const g = g_.data() + place(chunk);
  for (int l = 0; l < chunk_points; l += pack_width) {
    const std::int64_t p = chunk.first + l;
    Pack own[D], sums[D * D];
    for (int c = 0; c < D; ++c) own[c] = Pack::load(u.component(c) + p);
    for (std::size_t s = 0; s < f_.slots.shifts.size(); ++s) {
      for (int c = 0; c < D; ++c) {
        const Pack du = Pack::load(u.component(c) + p + f_.slots.shifts[s]) - own[c];
        for (int e = 0; e < D; ++e)
          sums[c * D + e] += du * Pack::load(g + (s * D + static_cast<std::size_t>(e)) * chunk_points + l);
      }
    }
    for (int c = 0; c < D * D; ++c) sums[c].store(H.component(c) + p);
  }
}

template <int D>
void LatticeStencils<D>::adjoint(const LatticeChunk& chunk, ConstFieldView S, FieldView f) const noexcept {
  const double* const g = g_.data() + place(chunk);
  const LatticePattern& pattern = f_.pattern(chunk);
  for (int l = 0; l < chunk_points; l += pack_width) {
    const std::int64_t p = chunk.first + l;
    Pack stress[D * D], own[D];
    for (int c = 0; c < D * D; ++c) stress[c] = Pack::load(S.component(c) + p);
    for (std::size_t s = 0; s < f_.slots.shifts.size(); ++s) {
      const std::uint8_t mask = pack_mask(pattern.mask[s], l);
      if (mask == 0) continue;
      for (int c = 0; c < D; ++c) {
        Pack t(0.0);
        for (int e = 0; e < D; ++e)
          t += stress[c * D + e] * Pack::load(g + (s * D + static_cast<std::size_t>(e)) * chunk_points + l);
        own[c] += t;
        add_to_cells(f.component(c) + p + f_.slots.shifts[s], -t, mask);
      }
    }
    for (int c = 0; c < D; ++c) (Pack::load(f.component(c) + p) + own[c]).store(f.component(c) + p);
  }
}

template class LatticeStencils<1>;
template class LatticeStencils<2>;
template class LatticeStencils<3>;

}  // namespace perikit
