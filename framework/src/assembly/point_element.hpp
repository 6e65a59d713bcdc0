#pragma once
/// All that one point owns: its evaluation points as gradients over the nodes of its family, and the dense matrix that they give.

#include <memory>
#include <vector>

#include "assembly/block_rows.hpp"
#include "assembly/tangent_batch.hpp"
#include "perikit/core/block_matrix.hpp"
#include "spaces/evaluation_points.hpp"

namespace perikit {

/// The nodes of a row, ascending: its family and the point itself. Returns the place of the point.
std::size_t element_nodes(const BlockRows& rows, std::size_t row, std::vector<std::int32_t>& nodes);

/// K += S over these nodes: S[a][b][k][l], width x width each. symmetric: only tiles of 8 x 8 on and above the diagonal are there.
template <int D>
void scatter_element(const std::vector<std::int32_t>& nodes, const double* S, std::size_t width, bool symmetric, BlockMatrix& K);

/// Nodes: the owner and its family, ascending.
template <int D>
struct PointElement {
  int nodes = 0, own = 0;      ///< own: place of the owner among the nodes
  int points = 0;              ///< evaluation points with a weight
  std::size_t width = 0;       ///< padded(nodes)
  AlignedVector<double> g;     ///< [q][e][node], the owner's own gradient first (with the selective map), then points
  AlignedVector<double> test;  ///< likewise what stresses are tested with, where that is another thing (local force states); else empty
  std::vector<double> weight;  ///< W_q [m^3]
  std::vector<int> which;      ///< of the parts or bonds of the owner
  const double* row(int q, int e) const noexcept { return g.data() + static_cast<std::size_t>(q * D + e) * width; }
};

/// Reused memory, and the result of `stiffness`.
template <int D>
struct ElementScratch {
  AlignedVector<double> T;  ///< A g of eight nodes
  AlignedVector<double> K;  ///< [a][b][k][l], width x width each; of symmetric ones tiles of 8 x 8 on and above the diagonal
};

template <int D>
void build_element(const BlockRows& rows, const Formulation& formulation, std::size_t row, EvaluationPoints<D>& points, PointElement<D>& out);

/// s.K <- sum_q W_q g_q . A_q . g_q with the tangents of lanes first_lane ... of the batch. symmetric: only tiles of 8 x 8 on and above the diagonal.
template <int D>
void stiffness(const PointElement<D>& element, const TangentBatch<D>& batch, int first_lane, bool selective, bool symmetric,
               ElementScratch<D>& s);

}  // namespace perikit
