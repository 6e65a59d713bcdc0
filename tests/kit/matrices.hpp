#pragma once
/// Assembled tangents beside the action of tangents.

#include <algorithm>
#include <cmath>

#include "perikit/problem/problem.hpp"

namespace perikit::test {

/// K w on all points.
inline Field product(const Problem& problem, const BlockMatrix& K, ConstFieldView w) {
  Field out = problem.make_field();
  const auto d = static_cast<std::size_t>(K.dimension);
  for (std::size_t r = 0; r < K.rows(); ++r)
    for (auto b = static_cast<std::size_t>(K.row_first[r]); b < static_cast<std::size_t>(K.row_first[r + 1]); ++b)
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t c = 0; c < d; ++c)
          out.component(static_cast<int>(a))[K.point[r]] += K.values[(b * d + a) * d + c] * w.component(static_cast<int>(c))[K.point[static_cast<std::size_t>(K.column[b])]];
  return out;
}

/// The largest |K w - Kw| over the largest |Kw|, both over all live points.
inline double product_error(const Problem& problem, const BlockMatrix& K, ConstFieldView w, ConstFieldView Kw) {
  const Field off = product(problem, K, w);
  double worst = 0, most = 0;
  for (const std::int32_t p : problem.body().internal())
    for (int c = 0; c < Kw.components; ++c) {
      const double here = std::abs(off.component(c)[p] - Kw.component(c)[p]);
      worst = std::isnan(here) ? INFINITY : std::max(worst, here);
      most = std::max(most, std::abs(Kw.component(c)[p]));
    }
  return worst / most;
}

}  // namespace perikit::test
