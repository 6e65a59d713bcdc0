#include "assembly/element_assembly.hpp"

#include <algorithm>

#include "families/cloud/cloud_rows.hpp"
#include "operators/laminates.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

template <int D>
ElementAssembly<D>::ElementAssembly(const SpaceParts& parts, RememberedPoints remembered, const BlockRows& rows)
    : rows_(rows),
      remembered_(std::move(remembered)),
      numbers_(remembered_.numbers_of(rows)),
      interfaces_(parts.interfaces),
      shape_{parts.formulation, parts.formulation.parts(D), parts.factors, parts.shift},
      blocks_(rows.size(), rows.body().block_points()),
      colouring_(cloud_reach(rows.lists(), blocks_)) {
  for (std::size_t r = 0; r < rows.size() && !whole_; ++r) {
    if (!rows.whole(r)) continue;
    ElementScratch<D> scratch;
    build_element<D>(rows, shape_, r, whole_.emplace(), scratch);
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
  const int owners = shape_.formulation.selective() ? 1 : 0;
  double Hbar[D * D] = {};
  for (int c = 0; c < D && owners > 0; ++c)
    for (int e = 0; e < D; ++e) Hbar[c * D + e] = gradient(0, c, e);
  for (int q = 0; q < element.points; ++q) {
    const std::size_t which = static_cast<std::size_t>(element.which[static_cast<std::size_t>(q)]),
                      at = (shape_.parts > 0 ? row * static_cast<std::size_t>(shape_.parts) : rows_.first(row)) + which;
    const int lane = m.batch.add(static_cast<std::int32_t>(p), element.weight[static_cast<std::size_t>(q)], rows_.families().remaining_influence(p),
                                 numbers_.empty() ? -1 : numbers_[at]);
    const auto of_value = [&](const auto& value, double* to) {
      const double own = value(p);
      for (std::size_t k = 0; k < m.nodes.size(); ++k) {
        const double difference = value(rows_.point(static_cast<std::size_t>(m.nodes[k]))) - own;
        for (int e = 0; e < D; ++e) to[e] += element.row(owners + q, e)[k] * difference;
      }
    };
    if (LaminatePoint point; interfaces_ && laminate_by_stencil(D, *interfaces_, static_cast<std::int32_t>(p), of_value, point)) m.batch.add_laminate(point);
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
    if (!rows_.whole(r)) build_element<D>(rows_, shape_, r, own, m.scratch);
    m.of_row.push_back(rows_.whole(r) ? &*whole_ : &own);
    add_lanes(r, *m.of_row.back(), at.u(), m);
  }
  const int bad = m.batch.evaluate(at.time_step(), K.convex);
  if (bad >= 0) return m.batch.owner(bad);
  int lane = 0;
  for (std::size_t r = first; r < last; ++r) {
    const PointElement<D>& element = *m.of_row[r - first];
    element_nodes(rows_, r, m.nodes);
    const bool symmetric = element.test.empty() && remembered_.points.laws().symmetric_tangent();
    stiffness<D>(element, m.batch, lane, shape_.formulation.selective(), symmetric, m.scratch);
    scatter_element<D>(m.nodes, m.scratch.K.data(), element.width, symmetric, K);
    lane += element.points;
  }
  return -1;
}

template <int D>
std::int64_t ElementAssembly<D>::add(const Configuration& at, BlockMatrix& K) {
  if (shape_.formulation.force_state == ForceState::local || !remembered_.points.laws().symmetric_tangent()) K.symmetric = false;
  memory_.prepare([&] { return std::make_unique<Memory>(remembered_.points, shape_.formulation.selective()); });
  // Enough points at once to fill batches of the materials.
  const std::size_t bonds = rows_.bonds() / rows_.size() + 1;
  const std::size_t at_once =
      std::max<std::size_t>(1, batch_points / (shape_.parts > 0 ? static_cast<std::size_t>(shape_.parts) : bonds));
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
