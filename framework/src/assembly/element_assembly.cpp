#include "assembly/element_assembly.hpp"

#include <algorithm>

#include "families/cloud/cloud_rows.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

template <int D>
ElementAssembly<D>::ElementAssembly(const SpaceParts& parts, const LawsOfSpace& laws, const BlockRows& rows)
    : parts_(parts),
      laws_(laws),
      rows_(rows),
      formulation_(parts.formulation),
      blocks_(rows.size(), rows.body().block_points()),
      colouring_(cloud_reach(rows.lists(), blocks_)) {
  for (std::size_t r = 0; r < rows.size() && !whole_; ++r) {
    if (!rows.whole(r)) continue;
    EvaluationPoints<D> points(parts_);
    build_element<D>(rows, formulation_, r, points, whole_.emplace());
  }
}

template <int D>
void ElementAssembly<D>::add_lanes(std::size_t row, const PointElement<D>& element, ConstFieldView u, Memory& m) const {
  const std::size_t p = rows_.point(row);
  element_nodes(rows_, row, m.nodes);
  m.u.assign(D * element.width, 0.0);
  for (std::size_t c = 0; c < D; ++c)
    for (std::size_t k = 0; k < m.nodes.size(); ++k) {
      const double* value = u.component(static_cast<int>(c));
      m.u[c * element.width + k] = value[rows_.point(static_cast<std::size_t>(m.nodes[k]))] - value[p];
    }
  const auto gradient = [&](int q, int c, int e) {
    const double* g = element.row(q, e);
    const double* du = m.u.data() + static_cast<std::size_t>(c) * element.width;
    EightSums sums;
    for (std::size_t k = 0; k < element.width; k += pack_width) sums.at(static_cast<int>(k)) += Pack::load(g + k) * Pack::load(du + k);
    return sums.total();
  };
  const int owners = formulation_.selective() ? 1 : 0;
  double Hbar[D * D] = {};
  for (int c = 0; c < D && owners > 0; ++c)
    for (int e = 0; e < D; ++e) Hbar[c * D + e] = gradient(0, c, e);
  for (int q = 0; q < element.points; ++q) {
    const int which = element.which[static_cast<std::size_t>(q)];
    const auto far = formulation_.parts(D) > 0 ? std::int32_t{-1} : static_cast<std::int32_t>(rows_.point(static_cast<std::size_t>(rows_.neighbours(row)[static_cast<std::size_t>(which)])));
    const int lane = m.batch.add(p, far, which, element.weight[static_cast<std::size_t>(q)], rows_.families().remaining_influence(p));
    for (int c = 0; c < D; ++c)
      for (int e = 0; e < D; ++e) {
        m.batch.H(lane, c * D + e) = gradient(owners + q, c, e);
        if (owners > 0) m.batch.owner_H(lane, c * D + e) = Hbar[c * D + e];
      }
  }
}

template <int D>
std::int64_t ElementAssembly<D>::fill_rows(std::size_t first, std::size_t last, const Configuration& at, BlockMatrix& K,
                                           Memory& m) const {
  m.batch.clear();
  m.of_row.clear();
  m.elements.resize(std::max(m.elements.size(), last - first));
  for (std::size_t r = first; r < last; ++r) {
    PointElement<D>& own = m.elements[r - first];
    if (!rows_.whole(r)) build_element<D>(rows_, formulation_, r, m.points, own);
    m.of_row.push_back(rows_.whole(r) ? &*whole_ : &own);
    add_lanes(r, *m.of_row.back(), at.u(), m);
  }
  const int bad = m.batch.evaluate(at, K.convex);
  if (bad >= 0) return m.batch.owner(bad);
  int lane = 0;
  for (std::size_t r = first; r < last; ++r) {
    const PointElement<D>& element = *m.of_row[r - first];
    element_nodes(rows_, r, m.nodes);
    const bool symmetric = element.test.empty() && parts_.laws.symmetric_tangent();
    stiffness<D>(element, m.batch, lane, formulation_.selective(), symmetric, m.scratch);
    scatter_element<D>(m.nodes, m.scratch.K.data(), element.width, symmetric, K);
    lane += element.points;
  }
  return -1;
}

template <int D>
std::int64_t ElementAssembly<D>::add(const Configuration& at, BlockMatrix& K) {
  if (formulation_.force_state == ForceState::local || !parts_.laws.symmetric_tangent()) K.symmetric = false;
  memory_.prepare([&] { return std::make_unique<Memory>(parts_, laws_); });
  // Enough points at once to fill batches of the materials.
  const std::size_t bonds = rows_.bonds() / rows_.size() + 1;
  const std::size_t at_once =
      std::max<std::size_t>(1, batch_points / (formulation_.parts(D) > 0 ? static_cast<std::size_t>(formulation_.parts(D)) : bonds));
  FirstBad bad;
  colouring_.for_each([&](std::size_t b) {
    const std::size_t end = blocks_.end(b);
    for (std::size_t r = blocks_.begin(b); r < end; r += at_once) {
      const std::int64_t point = fill_rows(r, std::min(end, r + at_once), at, K, memory_.mine());
      if (point >= 0) return bad.report(point);
    }
  });
  return bad.point();
}

template class ElementAssembly<1>;
template class ElementAssembly<2>;
template class ElementAssembly<3>;

}  // namespace perikit
