#include "wave_compliance.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/parallel.hpp"

namespace perikit {

void WaveCompliance::make(const BlockMatrix& companion, ConstFieldView inverse_W) {
  companion_ = &companion;
  weight_.assign(companion.column.size(), 0.0);
  const auto d = static_cast<std::size_t>(companion.dimension);
  const auto point = [&](std::size_t row) { return static_cast<std::size_t>(companion.point[row]); };
  least_.assign(companion.rows(), 0.0);
  std::vector<double> share(companion.rows(), 0.0);  // sqrt(W_i^-1/t_i)
  parallel_for(companion.rows(), [&](std::size_t r) {
    if (inverse_W.data[point(r)] == 0) return;
    least_[r] = 0.01 * inverse_W.data[point(r)];
    double sum = 0;
    for (std::int64_t k = companion.row_first[r]; k < companion.row_first[r + 1]; ++k) {
      const auto block = static_cast<std::size_t>(k), column = static_cast<std::size_t>(companion.column[block]);
      if (column == r || inverse_W.data[point(column)] == 0) continue;
      double trace = 0;
      for (std::size_t a = 0; a < d; ++a) trace += companion.values[(block * d + a) * d + a];
      sum += weight_[block] = std::max(0.0, -trace);
    }
    share[r] = sum > 0 ? std::sqrt(inverse_W.data[point(r)] / sum) : 0.0;
  });
  parallel_for(companion.rows(), [&](std::size_t r) {
    for (std::int64_t k = companion.row_first[r]; k < companion.row_first[r + 1]; ++k) {
      const auto block = static_cast<std::size_t>(k);
      weight_[block] *= share[r] * share[static_cast<std::size_t>(companion.column[block])];
    }
  });
}

void WaveCompliance::multiply(ConstFieldView p, FieldView Rp) const {
  const BlockMatrix& C = *companion_;
  parallel_for(C.rows(), [&](std::size_t r) {
    const double own = p.data[C.point[r]];
    double sum = least_[r] * own;
    for (std::int64_t k = C.row_first[r]; k < C.row_first[r + 1]; ++k) {
      const auto block = static_cast<std::size_t>(k);
      sum += weight_[block] * (own - p.data[C.point[static_cast<std::size_t>(C.column[block])]]);
    }
    Rp.data[C.point[r]] = sum;
  });
}

}  // namespace perikit
