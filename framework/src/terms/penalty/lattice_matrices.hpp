#pragma once
#include "families/lattice/lattice_families.hpp"
#include "terms/family_point.hpp"
#include "terms/penalty/penalty_element.hpp"
#include "terms/penalty/penalty_matrix.hpp"

namespace perikit {

/// M of the points of a chunk <- factor M_i, 0 where a point is not penalised.
template <int D, bool isotropic>
void set_penalty_matrices(const PenaltyParts& parts, const LatticeFamilies& families, const LatticeChunk& chunk, double factor, FieldView M) {
  const LatticePattern& pattern = families.pattern(chunk);
  for (int l = 0; l < chunk_points; ++l) {
    constexpr int components = PenaltyMatrix<D, isotropic>::components;
    for (int c = 0; c < components; ++c) M.component(c)[chunk.first + l] = 0;
    if (!(pattern.live >> l & 1) || !penalised(pattern.condition[l])) continue;
    const auto p = static_cast<std::size_t>(chunk.first + l);
    double intact = 0, inverse[6], of_point[6];
    for (std::size_t s = 0; s < families.slots.size(); ++s) intact += pattern.b(s, l) * families.slots.omega[s];
    families.inverse_shape(pattern, l, inverse);
    parts.stabilization->penalty(penalty_point(families, parts.laws, p, families.volume * intact, inverse), of_point);
    for (int c = 0; c < components; ++c) M.component(c)[p] = factor * of_point[c];
  }
}

}  // namespace perikit
