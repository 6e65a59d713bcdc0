#include "run/gathering.hpp"

#include <algorithm>
#include <cstring>

#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// Points whose values are sent at a time.
constexpr std::size_t piece = std::size_t{1} << 17;

/// Takes the next row of the rank that owns each point: ranks have them in the same order.
template <class Owner>
std::vector<double> merge(std::span<const double> mine, std::size_t width, std::size_t rows, Owner&& owner) {
  std::vector<double> all;
  const std::vector<std::vector<std::byte>> parts = communicator().gather(std::as_bytes(mine));
  if (parts.empty()) return all;
  all.resize(rows * width);
  std::vector<std::size_t> next(parts.size(), 0);
  const std::size_t bytes = width * sizeof(double);
  for (std::size_t n = 0; n < rows; ++n) {
    const auto rank = static_cast<std::size_t>(owner(n));
    std::memcpy(&all[n * width], parts[rank].data() + next[rank], bytes);
    next[rank] += bytes;
  }
  return all;
}

}  // namespace

void gather_points(const BodyProblem& problem, std::span<const double> mine, std::size_t width,
                   const std::function<void(std::size_t first, std::span<const double> rows)>& use) {
  if (!problem.partition()) return use(0, mine);
  const auto owners = problem.partition()->owners().first(problem.whole().owned().size());
  std::size_t sent = 0;
  for (std::size_t first = 0; first < owners.size(); first += piece) {
    const auto of_piece = owners.subspan(first, std::min(piece, owners.size() - first));
    const auto own = static_cast<std::size_t>(std::ranges::count(of_piece, communicator().rank()));
    const std::vector<double> rows = merge(mine.subspan(sent * width, own * width), width, of_piece.size(), [&](std::size_t n) { return of_piece[n]; });
    sent += own;
    if (!rows.empty()) use(first, rows);
  }
}

std::vector<double> gather_set(const BodyProblem& problem, const std::string& set, std::span<const double> mine) {
  if (!problem.partition()) return {mine.begin(), mine.end()};
  const Body& whole = problem.whole();
  const auto owners = problem.partition()->owners();
  const auto& members = whole.set(set);
  return merge(mine, 1, members.size(), [&](std::size_t n) {
    return owners[static_cast<std::size_t>(whole.input_of(static_cast<std::size_t>(members[n])))];
  });
}

}  // namespace perikit
