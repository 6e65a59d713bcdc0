#include "spaces/lattice_stencils.hpp"

#include "spaces/bond_kernel.hpp"
#include "spaces/local_stencil.hpp"
#include "perikit/core/parallel.hpp"
#include "families/reproducing_kernel.hpp"

namespace perikit {

template <int D>
LatticeStencils<D>::LatticeStencils(const LatticeFamilies& families, int order)
    : f_(families),
      stencil_size_(families.offsets.size() * D * chunk_points),
      g_((families.patterns.size() + 1) * stencil_size_, 0.0) {
  std::vector<std::size_t> lower(f_.patterns.size() + 1, 0), members(lower.size(), 0);
  for (const LatticeChunk& chunk : f_.chunks) ++members[static_cast<std::size_t>(chunk.pattern + 1)];
  parallel_for(lower.size(), [&](std::size_t k) {
    const LatticePattern& pattern = k == 0 ? f_.whole : f_.patterns[k - 1];
    double* const stored = g_.data() + k * stencil_size_;
    FamilyArrays family;
    std::vector<double> g;
    for (std::size_t l = 0; l < chunk_points; ++l) {
      if (!(pattern.live >> l & 1)) continue;
      const std::vector<std::uint16_t> slots = f_.intact_slots(pattern, static_cast<int>(l));
      f_.load(slots, family);
      lower[k] += reproducing_kernel(family, f_.body.horizon(), order, g) < order;
      for (std::size_t b = 0; b < slots.size(); ++b)
        for (std::size_t e = 0; e < D; ++e) stored[(slots[b] * D + e) * chunk_points + l] = g[b * D + e];
    }
  });
  for (std::size_t k = 0; k < lower.size(); ++k) fallbacks_ += lower[k] * members[k];
}

template <int D>
void LatticeStencils<D>::gradient(const LatticeChunk& chunk, ConstFieldView u, FieldView H) const noexcept {
  const double* const g = stencil(chunk);
  for (int l = 0; l < chunk_points; l += pack_width) {
    const std::int64_t p = chunk.first + l;
    Pack own[D], sums[D * D];
    for (int c = 0; c < D; ++c) own[c] = Pack::load(u.component(c) + p);
    for (std::size_t s = 0; s < f_.shifts.size(); ++s) {
      for (int c = 0; c < D; ++c) {
        const Pack du = Pack::load(u.component(c) + p + f_.shifts[s]) - own[c];
        for (int e = 0; e < D; ++e)
          sums[c * D + e] += du * Pack::load(g + (s * D + static_cast<std::size_t>(e)) * chunk_points + l);
      }
    }
    for (int c = 0; c < D * D; ++c) sums[c].store(H.component(c) + p);
  }
}

template <int D>
void LatticeStencils<D>::adjoint(const LatticeChunk& chunk, ConstFieldView S, FieldView f) const noexcept {
  const double* const g = stencil(chunk);
  const LatticePattern& pattern = f_.pattern(chunk);
  for (int l = 0; l < chunk_points; l += pack_width) {
    const std::int64_t p = chunk.first + l;
    Pack stress[D * D], own[D];
    for (int c = 0; c < D * D; ++c) stress[c] = Pack::load(S.component(c) + p);
    for (std::size_t s = 0; s < f_.shifts.size(); ++s) {
      const std::uint8_t mask = pack_mask(pattern.mask[s], l);
      if (mask == 0) continue;
      for (int c = 0; c < D; ++c) {
        Pack t(0.0);
        for (int e = 0; e < D; ++e)
          t += stress[c * D + e] * Pack::load(g + (s * D + static_cast<std::size_t>(e)) * chunk_points + l);
        own[c] += t;
        add_to_cells(f.component(c) + p + f_.shifts[s], -t, mask);
      }
    }
    for (int c = 0; c < D; ++c) (Pack::load(f.component(c) + p) + own[c]).store(f.component(c) + p);
  }
}

template class LatticeStencils<1>;
template class LatticeStencils<2>;
template class LatticeStencils<3>;

}  // namespace perikit
