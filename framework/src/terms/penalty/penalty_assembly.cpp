#include "terms/penalty/penalty_assembly.hpp"

#include <algorithm>

#include "assembly/point_element.hpp"
#include "families/cloud/cloud_rows.hpp"

namespace perikit {

template <int D>
PenaltyAssembly<D>::PenaltyAssembly(const PenaltyParts& parts, const BlockRows& rows)
    : parts_(parts), rows_(rows), blocks_(rows.size(), rows.body().block_points()), colouring_(cloud_reach(rows.lists(), blocks_)) {}

template <int D>
void PenaltyAssembly<D>::add_row(std::size_t row, BlockMatrix& K, Memory& m) const {
  if (!m.element.load(parts_, rows_.point(row))) return;
  m.element.form(element_nodes(rows_, row, m.nodes), m.N);
  const double* N = m.N.data();
  for (const std::int32_t node : m.nodes) {
    const std::int64_t first = K.row_first[static_cast<std::size_t>(node)];
    const std::int32_t* column = K.column.data() + first;
    double* block = K.values.data() + first * (D * D);
    for (std::size_t l = 0; l < m.nodes.size(); ++l, ++N, ++column, block += D * D) {
      for (; *column != m.nodes[l]; ++column) block += D * D;   // both ascend
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) block[a * D + b] += m.element.matrix(a, b) * *N;
    }
  }
}

template <int D>
std::int64_t PenaltyAssembly<D>::add(const Configuration&, BlockMatrix& K) {
  memory_.prepare([] { return std::make_unique<Memory>(); });
  colouring_.for_each([&](std::size_t b) {
    for (std::size_t r = blocks_.begin(b); r < blocks_.end(b); ++r) add_row(r, K, memory_.mine());
  });
  return -1;
}

template class PenaltyAssembly<1>;
template class PenaltyAssembly<2>;
template class PenaltyAssembly<3>;

}  // namespace perikit
