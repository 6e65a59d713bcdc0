#include "assembly/point_element.hpp"

#include <algorithm>

#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

constexpr std::size_t tile = padding;

/// Row q of all of an element from the gradient over bonds, g(k, e); the owner's entry makes the sum zero.
template <int D, class Gradient>
void write_point(const PointElement<D>& out, AlignedVector<double>& all, int q, Gradient&& gradient) {
  for (int e = 0; e < D; ++e) {
    double* to = all.data() + static_cast<std::size_t>(q * D + e) * out.width;
    double sum = 0;
    for (int k = 0; k < out.nodes - 1; ++k) sum += to[k < out.own ? k : k + 1] = gradient(k, e);
    to[out.own] = -sum;
  }
}

}  // namespace

std::size_t element_nodes(const BlockRows& rows, std::size_t row, std::vector<std::int32_t>& nodes) {
  const auto neighbours = rows.neighbours(row);
  nodes.assign(neighbours.begin(), neighbours.end());
  const auto own = std::lower_bound(nodes.begin(), nodes.end(), static_cast<std::int32_t>(row)) - nodes.begin();
  nodes.insert(nodes.begin() + own, static_cast<std::int32_t>(row));
  return static_cast<std::size_t>(own);
}

template <int D>
void scatter_element(const std::vector<std::int32_t>& nodes, const double* S, std::size_t width, bool symmetric, BlockMatrix& K) {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto row = static_cast<std::size_t>(nodes[k]);
    const std::int32_t* column = K.column.data() + K.row_first[row];
    double* block = K.values.data() + K.row_first[row] * (D * D);
    for (std::size_t l = 0; l < nodes.size(); ++l, ++column, block += D * D) {
      for (; *column != nodes[l]; ++column) block += D * D;   // both ascend
      const bool there = !symmetric || k / padding <= l / padding;
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b)
          block[a * D + b] += there ? S[((a * D + b) * width + k) * width + l] : S[((b * D + a) * width + l) * width + k];
    }
  }
}

template <int D>
void build_element(const BlockRows& rows, const Formulation& formulation, std::size_t row, EvaluationPoints<D>& points, PointElement<D>& out) {
  const auto neighbours = rows.neighbours(row);
  out.nodes = static_cast<int>(neighbours.size()) + 1;
  out.own = static_cast<int>(std::lower_bound(neighbours.begin(), neighbours.end(), static_cast<std::int32_t>(row)) - neighbours.begin());
  out.width = padded(static_cast<std::size_t>(out.nodes));
  out.weight.clear();
  out.which.clear();
  out.test.clear();
  out.g.clear();
  out.points = 0;
  if (neighbours.empty()) {  // nothing to stretch
    out.g.assign(D * out.width, 0.0);
    return;
  }
  points.read(rows.point(row));
  const std::vector<double>& tested = points.tested();
  int rows_of_g = 0;
  // own: the bond of the evaluation point, the only one that its stress acts on where force states are local; -1: the owner's gradient.
  const auto write = [&](const double* g, int own) {
    const std::size_t size = static_cast<std::size_t>(++rows_of_g * D) * out.width;
    const auto gradient = [&](int k, int e) { return g[k * D + e]; };
    out.g.resize(size, 0.0);
    write_point<D>(out, out.g, rows_of_g - 1, gradient);
    if (tested.empty()) return;
    out.test.resize(size, 0.0);
    write_point<D>(out, out.test, rows_of_g - 1,
                   [&](int k, int e) { return own < 0 ? gradient(k, e) : k == own ? tested[static_cast<std::size_t>(k)] * gradient(k, e) : 0.0; });
  };
  if (formulation.selective()) write(points.gradient(-1), -1);
  for (int q = 0; q < points.points(); ++q) {
    const double weight = points.weight(q);
    if (weight == 0 && formulation.weighted) continue;  // a dropped part
    write(points.gradient(q), q);
    out.weight.push_back(weight);
    out.which.push_back(q);
    ++out.points;
  }
}

// K_kl = sum over rows r, s of g_rk M_rs g_sl. Eight columns l at a time: T_r = sum_s M_rs g_sl, then products with g_rk, all for
// each pair (a, b) of displacement components.
template <int D>
void stiffness(const PointElement<D>& element, const TangentBatch<D>& batch, int first_lane, bool selective, bool symmetric,
               ElementScratch<D>& s) {
  constexpr int n = D * D, packs = static_cast<int>(tile) / pack_width;
  const std::size_t width = element.width, owners = selective ? 1 : 0,
                    rows = (owners + static_cast<std::size_t>(element.points)) * D;
  s.T.resize(n * rows * tile);
  s.K.resize(n * width * width);
  for (std::size_t column = 0; column < width; column += tile) {
    const auto T = [&](int a, int b, std::size_t r) {
      return s.T.data() + (static_cast<std::size_t>(a * D + b) * rows + r) * tile;
    };
    for (int v = 0; v < packs; ++v) {
      const std::size_t at = column + static_cast<std::size_t>(v * pack_width);
      const int lane_in_tile = v * pack_width;
      Pack g_bar[D], bar[D][D][D];
      for (int f = 0; f < D && selective; ++f) g_bar[f] = Pack::load(element.row(0, f) + at);
      for (int q = 0; q < element.points; ++q) {
        const double* own = batch.own(first_lane + q);
        const int point = static_cast<int>(owners) + q;
        Pack g[D];
        for (int f = 0; f < D; ++f) g[f] = Pack::load(element.row(point, f) + at);
        for (int a = 0; a < D; ++a)
          for (int e = 0; e < D; ++e)
            for (int b = 0; b < D; ++b) {
              Pack sum(0.0);
              for (int f = 0; f < D; ++f) sum += Pack(own[(a * D + e) * n + b * D + f]) * g[f];
              if (selective) {
                const double* mixed = batch.mixed(first_lane + q);
                const double* back = batch.back(first_lane + q);
                const double* owner = batch.bar(first_lane + q);
                for (int f = 0; f < D; ++f) {
                  sum += Pack(mixed[(a * D + e) * n + b * D + f]) * g_bar[f];
                  bar[a][e][b] +=
                      Pack(back[(a * D + e) * n + b * D + f]) * g[f] + Pack(owner[(a * D + e) * n + b * D + f]) * g_bar[f];
                }
              }
              sum.store(T(a, b, static_cast<std::size_t>(point * D + e)) + lane_in_tile);
            }
      }
      for (int a = 0; a < D && selective; ++a)
        for (int e = 0; e < D; ++e)
          for (int b = 0; b < D; ++b) bar[a][e][b].store(T(a, b, static_cast<std::size_t>(e)) + lane_in_tile);
    }
    for (int ab = 0; ab < n; ++ab) {
      const double* right = s.T.data() + static_cast<std::size_t>(ab) * rows * tile;
      for (std::size_t k = 0; k < (symmetric ? column + tile : width); k += 4) {
        Pack sums[4][packs];
        for (std::size_t r = 0; r < rows; ++r) {
          const double* left = (element.test.empty() ? element.g : element.test).data() + r * width + k;
          for (int v = 0; v < packs; ++v) {
            const Pack t = Pack::load(right + r * tile + static_cast<std::size_t>(v * pack_width));
            for (int i = 0; i < 4; ++i) sums[i][v] += Pack(left[i]) * t;
          }
        }
        for (std::size_t i = 0; i < 4; ++i)
          for (int v = 0; v < packs; ++v)
            sums[i][v].store(s.K.data() + (static_cast<std::size_t>(ab) * width + k + i) * width + column +
                             static_cast<std::size_t>(v * pack_width));
      }
    }
  }
}

template void scatter_element<1>(const std::vector<std::int32_t>&, const double*, std::size_t, bool, BlockMatrix&);
template void build_element<1>(const BlockRows&, const Formulation&, std::size_t, EvaluationPoints<1>&, PointElement<1>&);
template void scatter_element<2>(const std::vector<std::int32_t>&, const double*, std::size_t, bool, BlockMatrix&);
template void build_element<2>(const BlockRows&, const Formulation&, std::size_t, EvaluationPoints<2>&, PointElement<2>&);
template void scatter_element<3>(const std::vector<std::int32_t>&, const double*, std::size_t, bool, BlockMatrix&);
template void build_element<3>(const BlockRows&, const Formulation&, std::size_t, EvaluationPoints<3>&, PointElement<3>&);
template void stiffness<1>(const PointElement<1>&, const TangentBatch<1>&, int, bool, bool, ElementScratch<1>&);
template void stiffness<2>(const PointElement<2>&, const TangentBatch<2>&, int, bool, bool, ElementScratch<2>&);
template void stiffness<3>(const PointElement<3>&, const TangentBatch<3>&, int, bool, bool, ElementScratch<3>&);

}  // namespace perikit
