#include "wave_compliance.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/field_operations.hpp"

namespace perikit {

WaveCompliance::WaveCompliance(Problem& problem) : problem_(problem) {
  if (problem.points().distributed()) seen_ = problem.points().make_field(1);
}

void WaveCompliance::make(const BlockMatrix& companion, ConstFieldView inverse_W) {
  companion_ = &companion;
  weight_.assign(companion.column.size(), 0.0);
  const auto d = static_cast<std::size_t>(companion.dimension);
  const auto point = [&](std::size_t row) { return static_cast<std::size_t>(companion.point[row]); };
  least_.assign(companion.rows(), 0.0);
  Field of_all = problem_.points().make_field(1), share = problem_.points().make_field(1);  // W^-1 of ghosts, too; sqrt(W_i^-1/t_i)
  copy(inverse_W, of_all);
  problem_.share(of_all);
  parallel_for(companion.rows(), [&](std::size_t r) {
    if (inverse_W.data[point(r)] == 0) return;
    least_[r] = 0.01 * inverse_W.data[point(r)];
    double sum = 0;
    for (std::int64_t k = companion.row_first[r]; k < companion.row_first[r + 1]; ++k) {
      const auto block = static_cast<std::size_t>(k), column = static_cast<std::size_t>(companion.column[block]);
      if (column == r || of_all.data()[point(column)] == 0) continue;
      double trace = 0;
      for (std::size_t a = 0; a < d; ++a) trace += companion.values[(block * d + a) * d + a];
      sum += weight_[block] = std::max(0.0, -trace);
    }
    share.data()[point(r)] = sum > 0 ? std::sqrt(inverse_W.data[point(r)] / sum) : 0.0;
  });
  problem_.share(share);
  parallel_for(companion.rows(), [&](std::size_t r) {
    for (std::int64_t k = companion.row_first[r]; k < companion.row_first[r + 1]; ++k) {
      const auto block = static_cast<std::size_t>(k);
      weight_[block] *= share.data()[point(r)] * share.data()[point(static_cast<std::size_t>(companion.column[block]))];
    }
  });
}

void WaveCompliance::multiply(ConstFieldView p, FieldView Rp) {
  if (seen_.size() > 0) {
    copy(p, seen_);
    problem_.share(seen_);
    p = seen_;
  }
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
