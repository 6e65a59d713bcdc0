#include "body/partition/input_order.hpp"

#include <algorithm>

#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// Boxes along the axes of the input.
std::vector<CellBox> input_boxes(const Lattice& lattice, const std::vector<CellBox>& boxes) {
  std::vector<CellBox> turned = boxes;
  for (std::size_t r = 0; r < boxes.size(); ++r)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(lattice.axis[k]);
      turned[r].low[axis] = boxes[r].low[k];
      turned[r].high[axis] = boxes[r].high[k];
    }
  return turned;
}

/// The rows first ... last - 1 of a lattice with so many of them along y.
struct Rows {
  std::int64_t first, last, along_y;

  /// visit(row) for those in a box, ascending.
  template <class Visit>
  void in(const CellBox& box, Visit&& visit) const {
    if (box.cells() == 0 || first >= last) return;
    for (std::int64_t z = std::max(box.low[2], first / along_y); z < std::min(box.high[2], (last - 1) / along_y + 1); ++z)
      for (std::int64_t row = std::max(box.low[1] + along_y * z, first); row < std::min(box.high[1] + along_y * z, last); ++row)
        visit(row);
  }
  std::size_t count(const CellBox& box) const {
    std::size_t rows = 0;
    in(box, [&](std::int64_t) { ++rows; });
    return rows;
  }
};

/// What a rank has of a row.
struct Piece {
  std::int64_t row, x;
  std::size_t rank, at;  ///< its place in the message of the rank
};

}  // namespace

std::vector<std::int64_t> first_numbers_of_rows(const Lattice& lattice, const std::vector<CellBox>& of_ranks,
                                                std::span<const std::int64_t> points) {
  const std::vector<CellBox> boxes = input_boxes(lattice, of_ranks);
  std::array<std::int64_t, 3> cells{1, 1, 1};
  for (std::size_t k = 0; k < 3; ++k) cells[static_cast<std::size_t>(lattice.axis[k])] = lattice.extent[k];
  const std::size_t size = boxes.size(), me = static_cast<std::size_t>(communicator().rank());
  const std::int64_t rows = cells[1] * cells[2],
                     share = (rows + static_cast<std::int64_t>(size) - 1) / static_cast<std::int64_t>(size);
  const auto rows_of = [&](std::size_t rank) {
    const std::int64_t first = std::min(rows, share * static_cast<std::int64_t>(rank));
    return Rows{first, std::min(rows, first + share), cells[1]};
  };
  // to and from, by rank: rows of mine that the rank adds up, and those of the rank that I add up.
  std::vector<std::vector<double>> mine(size), theirs(size);
  auto next = points.begin();
  for (std::size_t r = 0; r < size; ++r) {
    const std::size_t count = rows_of(r).count(boxes[me]);
    mine[r].assign(next, next + static_cast<std::ptrdiff_t>(count));
    next += static_cast<std::ptrdiff_t>(count);
    theirs[r].resize(rows_of(me).count(boxes[r]));
  }
  const auto exchange = [&](std::vector<std::vector<double>>& to, std::vector<std::vector<double>>& from) {
    std::vector<Message> messages;
    for (std::size_t r = 0; r < size; ++r)
      if (r != me && (!to[r].empty() || !from[r].empty())) messages.push_back({static_cast<int>(r), to[r], from[r]});
    communicator().exchange(messages);
    from[me] = to[me];
  };
  exchange(mine, theirs);
  std::vector<Piece> pieces;
  for (std::size_t r = 0; r < size; ++r) {
    std::size_t at = 0;
    rows_of(me).in(boxes[r], [&](std::int64_t row) { pieces.push_back({row, boxes[r].low[0], r, at++}); });
  }
  std::ranges::sort(pieces, [](const Piece& a, const Piece& b) { return std::pair(a.row, a.x) < std::pair(b.row, b.x); });
  std::vector<std::int64_t> totals(size, 0);
  for (const Piece& piece : pieces) totals[me] += static_cast<std::int64_t>(theirs[piece.rank][piece.at]);
  communicator().sum(totals);
  double before = 0;
  for (std::size_t r = 0; r < me; ++r) before += static_cast<double>(totals[r]);
  for (const Piece& piece : pieces) {
    double& count = theirs[piece.rank][piece.at];
    const double number = before;
    before += count;
    count = number;
  }
  exchange(theirs, mine);
  std::vector<std::int64_t> numbers;
  for (const std::vector<double>& of_rank : mine)
    for (const double number : of_rank) numbers.push_back(static_cast<std::int64_t>(number));
  return numbers;
}

}  // namespace perikit
