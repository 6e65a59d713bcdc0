#include "run/gathering.hpp"

#include <algorithm>
#include <cstdlib>

#include "core/ranks/merged_rows.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// Rows by number in an order that the scene gives.
std::vector<double> in_order(const std::vector<std::int64_t>& numbers, std::span<const std::int64_t> wanted, std::size_t width,
                             const std::vector<double>& rows) {
  std::vector<std::pair<std::int64_t, std::size_t>> place;
  for (const std::int64_t number : numbers) place.emplace_back(number, place.size());
  std::ranges::sort(place);
  std::vector<double> sorted;
  for (const std::int64_t number : wanted) {
    const auto found = std::ranges::lower_bound(place, std::pair(number, std::size_t{0}));
    const auto row = rows.begin() + static_cast<std::ptrdiff_t>(found->second * width);
    sorted.insert(sorted.end(), row, row + static_cast<std::ptrdiff_t>(width));
  }
  return sorted;
}

}  // namespace

void gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                   const std::function<void(std::size_t first, std::span<const double> rows)>& use) {
  const Points& points = problem.points();
  if (!points.distributed()) return use(0, mine);
  const std::vector<std::int64_t> numbers = points.numbers(points.owned());
  const std::size_t all = points.size_on_all_ranks();
  for (std::size_t first = 0; first < all; first += rows_of_piece) {
    const std::vector<double> rows =
        gather_piece(numbers, first, std::min(rows_of_piece, all - first), width,
                     [&](std::size_t from, std::size_t to) { return mine.subspan(from * width, (to - from) * width); });
    if (!rows.empty()) use(first, rows);
  }
}

std::size_t most_points_gathered() {
  static const std::size_t most = [] {
    const char* const text = std::getenv("PERIKIT_GATHERED_POINTS");
    return text ? static_cast<std::size_t>(std::strtoull(text, nullptr, 10)) : std::size_t{1} << 24;
  }();
  return most;
}

void share_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                  const std::function<void(std::size_t first, std::span<const double> rows)>& use) {
  const std::vector<std::int64_t> numbers = problem.points().numbers(problem.points().owned());
  const std::size_t all = problem.points().size_on_all_ranks(), piece = std::clamp<std::size_t>(most_points_gathered(), 1, rows_of_piece);
  const auto ranks = static_cast<std::size_t>(communicator().size());
  const auto points = [&](std::size_t first) { return first < all ? std::min(piece, all - first) : 0; };
  std::vector<double> rows;
  for (std::size_t round = 0; round < all; round += ranks * piece) {
    // Everybody sends to everybody what is the other's in this round.
    std::vector<std::vector<std::int64_t>> to;
    for (std::size_t first = round; first < round + ranks * piece; first += piece)
      to.push_back(points(first) == 0 ? std::vector<std::int64_t>()
                                      : own_share(numbers, first, points(first), [&](std::size_t from, std::size_t end) {
                                          return mine.subspan(from * width, (end - from) * width);
                                        }));
    const std::size_t first = round + static_cast<std::size_t>(communicator().rank()) * piece;
    rows.resize(points(first) * width);
    for (const std::vector<std::int64_t>& of_rank : exchanged(to))
      if (!of_rank.empty()) unpack_share(std::as_bytes(std::span(of_rank)), width, rows);
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
  return gather_piece(body.numbers(here), first, points, width,
                      [&](std::size_t, std::size_t) { return std::span<const double>(rows); });
}

void gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine, std::size_t width,
                const std::function<void(std::span<const double> rows)>& use) {
  if (!problem.points().distributed()) return use(mine);
  if (set == "all") return gather_points(problem, mine, width, [&](std::size_t, std::span<const double> rows) { use(rows); });
  const Body& body = problem.body();
  const std::vector<std::int64_t> own = body.numbers(body.set(set));
  if (body.order_of(set).empty()) {
    const auto rows_of = [&](std::size_t from, std::size_t to) { return mine.subspan(from * width, (to - from) * width); };
    return over_merged_rows(std::span(own), width, rows_of,
                            [&](std::span<const std::int64_t>, std::span<const double> rows) { use(rows); });
  }
  const std::vector<std::int64_t> numbers = gathered<std::int64_t>(own);
  const std::vector<double> rows = gathered<double>(mine);
  if (communicator().rank() == 0) use(in_order(numbers, body.order_of(set), width, rows));
}

}  // namespace perikit
