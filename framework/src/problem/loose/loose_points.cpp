#include "problem/loose/loose_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace perikit {

double* diagonal_block(BlockMatrix& K, std::size_t row) {
  const auto begin = K.column.begin() + K.row_first[row], end = K.column.begin() + K.row_first[row + 1];
  const auto place = std::lower_bound(begin, end, static_cast<std::int32_t>(row)) - K.column.begin();
  return K.values.data() + static_cast<std::size_t>(place) * static_cast<std::size_t>(K.dimension * K.dimension);
}

void hold_loose_points(std::span<const BondChange> changed, BlockMatrix& K) {
  if (changed.empty()) return;
  constexpr double share = 1e-9;
  const auto d = static_cast<std::size_t>(K.dimension);
  double sum = 0;
  for (std::size_t row = 0; row < K.rows(); ++row)
    for (std::size_t c = 0; c < d; ++c) sum += std::abs(diagonal_block(K, row)[c * d + c]);
  const double held = share * sum / static_cast<double>(K.rows() * d);
  std::vector<std::uint8_t> loose(static_cast<std::size_t>(K.point.back()) + 1,
                                  0);  // by point; rows are in ascending order of them
  for (const BondChange& b : changed) loose[static_cast<std::size_t>(b.bond.point)] = loose[static_cast<std::size_t>(b.bond.far)] = 1;
  for (std::size_t row = 0; row < K.rows(); ++row)
    for (std::size_t c = 0; c < d && loose[static_cast<std::size_t>(K.point[row])]; ++c) diagonal_block(K, row)[c * d + c] += held;
}

}  // namespace perikit
