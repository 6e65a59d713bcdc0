#include "core/ranks/numbered_rows.hpp"

#include <algorithm>
#include <cstring>

#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// Numbers that follow each other, from `first` of a piece on.
struct Run {
  std::uint32_t first, count;
};

}  // namespace

std::vector<std::int64_t> own_share(std::span<const std::int64_t> numbers, std::size_t first, std::size_t count,
                                    const RowsOf& rows_of) {
  const auto begin = std::ranges::lower_bound(numbers, static_cast<std::int64_t>(first)),
             end = std::lower_bound(begin, numbers.end(), static_cast<std::int64_t>(first + count));
  std::vector<Run> runs;
  for (auto at = begin; at != end; ++at) {
    const auto offset = static_cast<std::uint32_t>(*at - static_cast<std::int64_t>(first));
    if (runs.empty() || runs.back().first + runs.back().count != offset) runs.push_back({offset, 0});
    ++runs.back().count;
  }
  const std::span<const double> rows =
      rows_of(static_cast<std::size_t>(begin - numbers.begin()), static_cast<std::size_t>(end - numbers.begin()));
  static_assert(sizeof(Run) == sizeof(std::int64_t));
  std::vector<std::int64_t> words(1 + runs.size() + rows.size());
  words[0] = std::ssize(runs);
  if (!runs.empty()) std::memcpy(&words[1], runs.data(), runs.size() * sizeof(Run));
  if (!rows.empty()) std::memcpy(&words[1 + runs.size()], rows.data(), rows.size_bytes());
  return words;
}

void unpack_share(std::span<const std::byte> share, std::size_t width, std::span<double> rows) {
  std::uint64_t runs = 0;
  std::memcpy(&runs, share.data(), sizeof runs);
  const std::byte* run_at = share.data() + sizeof runs;
  const std::byte* from = run_at + runs * sizeof(Run);
  for (; runs > 0; --runs, run_at += sizeof(Run)) {
    Run run{};
    std::memcpy(&run, run_at, sizeof run);
    const std::size_t size = run.count * width * sizeof(double);
    std::memcpy(&rows[run.first * width], from, size);
    from += size;
  }
}

std::vector<double> gather_piece(std::span<const std::int64_t> numbers, std::size_t first, std::size_t count, std::size_t width,
                                 const RowsOf& rows_of) {
  const std::vector<std::int64_t> mine = own_share(numbers, first, count, rows_of);
  std::vector<double> rows;
  for (const std::vector<std::byte>& of_rank : communicator().gather(std::as_bytes(std::span(mine)))) {
    rows.resize(count * width);
    unpack_share(of_rank, width, rows);
  }
  return rows;
}

}  // namespace perikit
