#include "run/gathering.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// Points that follow each other in the order of the input, from `first` of a piece on.
struct Run {
  std::uint32_t first, points;
};

/// What a rank sends of a piece: how many runs of points it has there, the runs, and the rows of their points.
std::vector<std::byte> packed(const std::vector<Run>& runs, std::span<const double> rows) {
  const std::uint64_t count = runs.size();
  std::vector<std::byte> bytes(sizeof count + runs.size() * sizeof(Run) + rows.size_bytes());
  std::byte* to = bytes.data();
  const auto add = [&](const void* from, std::size_t size) {
    if (size > 0) std::memcpy(to, from, size);
    to += size;
  };
  add(&count, sizeof count);
  add(runs.data(), runs.size() * sizeof(Run));
  add(rows.data(), rows.size_bytes());
  return bytes;
}

void unpack(const std::vector<std::byte>& bytes, std::size_t width, std::vector<double>& all) {
  std::uint64_t count = 0;
  std::memcpy(&count, bytes.data(), sizeof count);
  const std::byte* run_at = bytes.data() + sizeof count;
  const std::byte* from = run_at + count * sizeof(Run);
  for (; count > 0; --count, run_at += sizeof(Run)) {
    Run run{};
    std::memcpy(&run, run_at, sizeof run);
    const std::size_t size = run.points * width * sizeof(double);
    std::memcpy(&all[run.first * width], from, size);
    from += size;
  }
}

/// Input numbers of the points that this rank owns, ascending.
std::vector<std::int64_t> own_numbers(const Body& body, const std::vector<std::int32_t>& points) {
  std::vector<std::int64_t> numbers;
  numbers.reserve(points.size());
  for (const std::int32_t p : points) numbers.push_back(body.number(static_cast<std::size_t>(p)));
  return numbers;
}

/// A piece of `points` points from `first` on, of which this rank has rows for some: rows_of(from, to) are those of the points
/// from ... to - 1 of `numbers`.
template <class RowsOf>
std::vector<double> gather_piece(std::span<const std::int64_t> numbers, std::size_t first, std::size_t points, std::size_t width,
                                 RowsOf&& rows_of) {
  const auto begin = std::ranges::lower_bound(numbers, static_cast<std::int64_t>(first)),
             end = std::lower_bound(begin, numbers.end(), static_cast<std::int64_t>(first + points));
  std::vector<Run> runs;
  for (auto at = begin; at != end; ++at) {
    const auto offset = static_cast<std::uint32_t>(*at - static_cast<std::int64_t>(first));
    if (runs.empty() || runs.back().first + runs.back().points != offset) runs.push_back({offset, 0});
    ++runs.back().points;
  }
  const auto from = static_cast<std::size_t>(begin - numbers.begin()), to = static_cast<std::size_t>(end - numbers.begin());
  std::vector<double> all;
  for (const std::vector<std::byte>& of_rank : communicator().gather(packed(runs, rows_of(from, to)))) {
    all.resize(points * width);
    unpack(of_rank, width, all);
  }
  return all;
}

/// Rows of all ranks in ascending order of their numbers; those of each rank ascend already.
void put_in_order(const std::vector<std::vector<std::int64_t>>& numbers, std::size_t width, std::vector<double>& rows) {
  std::vector<std::int64_t> all;
  std::vector<std::size_t> ends, order;
  for (const std::vector<std::int64_t>& of_rank : numbers) {
    all.insert(all.end(), of_rank.begin(), of_rank.end());
    ends.push_back(all.size());
  }
  order.resize(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto at = [&](std::size_t k) { return order.begin() + static_cast<std::ptrdiff_t>(k); };
  for (std::size_t k = 1; k < ends.size(); ++k)
    std::inplace_merge(order.begin(), at(ends[k - 1]), at(ends[k]),
                       [&](std::size_t a, std::size_t b) { return all[a] < all[b]; });
  std::vector<double> sorted(rows.size());
  for (std::size_t n = 0; n < order.size(); ++n) std::copy_n(&rows[order[n] * width], width, &sorted[n * width]);
  rows = std::move(sorted);
}

/// In an order that the scene gives.
void put_in_order(const std::vector<std::vector<std::int64_t>>& numbers, std::span<const std::int64_t> wanted, std::size_t width,
                  std::vector<double>& rows) {
  std::vector<std::pair<std::int64_t, std::size_t>> place;
  for (const std::vector<std::int64_t>& of_rank : numbers)
    for (const std::int64_t number : of_rank) place.emplace_back(number, place.size());
  std::ranges::sort(place);
  std::vector<double> sorted;
  for (const std::int64_t number : wanted) {
    const auto found = std::ranges::lower_bound(place, std::pair(number, std::size_t{0}));
    const auto row = rows.begin() + static_cast<std::ptrdiff_t>(found->second * width);
    sorted.insert(sorted.end(), row, row + static_cast<std::ptrdiff_t>(width));
  }
  rows = std::move(sorted);
}

}  // namespace

void gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                   const std::function<void(std::size_t first, std::span<const double> rows)>& use) {
  const Body& body = problem.body();
  if (!problem.partition()) return use(0, mine);
  const std::vector<std::int64_t> numbers = own_numbers(body, body.owned());
  const std::size_t all = body.points_of_all_ranks();
  for (std::size_t first = 0; first < all; first += points_of_piece) {
    const std::vector<double> rows =
        gather_piece(numbers, first, std::min(points_of_piece, all - first), width,
                     [&](std::size_t from, std::size_t to) { return mine.subspan(from * width, (to - from) * width); });
    if (!rows.empty()) use(first, rows);
  }
}

std::vector<double> gather_rows(const Body& body, std::size_t first, std::size_t points, std::size_t width,
                                const std::function<void(std::size_t p, double* out)>& row) {
  const auto& owned = body.owned();
  const auto below = [&](std::int32_t p, std::size_t number) {
    return body.number(static_cast<std::size_t>(p)) < static_cast<std::int64_t>(number);
  };
  const auto begin = std::lower_bound(owned.begin(), owned.end(), first, below),
             end = std::lower_bound(begin, owned.end(), first + points, below);
  const std::vector<std::int32_t> here(begin, end);
  std::vector<double> rows(here.size() * width);
  for (std::size_t n = 0; n < here.size(); ++n) row(static_cast<std::size_t>(here[n]), &rows[n * width]);
  return gather_piece(own_numbers(body, here), first, points, width,
                      [&](std::size_t, std::size_t) { return std::span<const double>(rows); });
}

std::vector<double> gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine,
                               std::size_t width) {
  if (!problem.partition()) return {mine.begin(), mine.end()};
  const Body& body = problem.body();
  std::vector<double> all;
  if (set == "all") {
    gather_points(problem, mine, width,
                  [&](std::size_t, std::span<const double> rows) { all.insert(all.end(), rows.begin(), rows.end()); });
    return all;
  }
  const std::vector<std::int64_t> own = own_numbers(body, body.set(set));
  std::vector<std::vector<std::int64_t>> numbers;
  for (const std::vector<std::byte>& of_rank : communicator().gather(std::as_bytes(std::span(own)))) {
    std::vector<std::int64_t>& values = numbers.emplace_back(of_rank.size() / sizeof(std::int64_t));
    if (!of_rank.empty()) std::memcpy(values.data(), of_rank.data(), of_rank.size());
  }
  all = gathered<double>(mine);
  if (numbers.empty()) return all;
  const std::span<const std::int64_t> wanted = body.order_of(set);
  wanted.empty() ? put_in_order(numbers, width, all) : put_in_order(numbers, wanted, width, all);
  return all;
}

}  // namespace perikit
