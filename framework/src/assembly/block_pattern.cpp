#include "assembly/block_pattern.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/parallel.hpp"

namespace perikit {

const std::vector<std::int32_t>& Reach::of(const BlockRows& rows, std::size_t row, int steps) {
  place_.resize(rows.size(), -1);
  for (const std::int32_t r : found_) place_[static_cast<std::size_t>(r)] = -1;
  found_.assign(1, static_cast<std::int32_t>(row));
  place_[row] = 0;
  std::size_t begin = 0;
  for (int step = 0; step < steps; ++step) {
    const std::size_t end = found_.size();
    for (; begin < end; ++begin) {
      for (const std::int32_t j : rows.neighbours(static_cast<std::size_t>(found_[begin]))) {
        if (place_[static_cast<std::size_t>(j)] >= 0) continue;
        place_[static_cast<std::size_t>(j)] = static_cast<std::int32_t>(found_.size());
        found_.push_back(j);
      }
    }
  }
  return found_;
}

void make_pattern(const BlockRows& rows, int steps, BlockMatrix& K) {
  constexpr std::size_t block_rows = 64;
  const std::size_t n = rows.size(), blocks = (n + block_rows - 1) / block_rows;
  K.dimension = rows.body().dimension();
  K.symmetric = true;
  K.point = rows.points();
  K.row_first.assign(n + 1, 0);
  std::vector<Reach> reach(static_cast<std::size_t>(thread_count()));
  std::vector<std::vector<std::int32_t>> columns(blocks);
  parallel_for(blocks, [&](std::size_t b) {
    for (std::size_t r = b * block_rows; r < std::min(n, (b + 1) * block_rows); ++r) {
      const std::vector<std::int32_t>& found = reach[static_cast<std::size_t>(thread_index())].of(rows, r, steps);
      const auto begin = columns[b].insert(columns[b].end(), found.begin(), found.end());
      std::sort(begin, columns[b].end());
      K.row_first[r + 1] = static_cast<std::int64_t>(found.size());
    }
  });
  for (std::size_t r = 0; r < n; ++r) K.row_first[r + 1] += K.row_first[r];
  K.column.resize(static_cast<std::size_t>(K.row_first[n]));
  parallel_for(blocks, [&](std::size_t b) {
    std::copy(columns[b].begin(), columns[b].end(), K.column.begin() + K.row_first[b * block_rows]);
  });
  K.values.resize(K.column.size() * static_cast<std::size_t>(K.dimension * K.dimension));
}

std::size_t predict_blocks(const BlockRows& rows, int steps) {
  constexpr std::size_t most = 256;
  const std::size_t n = rows.size(), samples = std::min(n, most);
  Reach reach;
  double blocks = 0;
  for (std::size_t k = 0; k < samples; ++k) blocks += static_cast<double>(reach.of(rows, k * n / samples, steps).size());
  return static_cast<std::size_t>(std::ceil(blocks * static_cast<double>(n) / static_cast<double>(samples)));
}

}  // namespace perikit
