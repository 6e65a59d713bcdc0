/// Partition of a lattice that no rank has as a whole.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "body/input_numbers.hpp"
#include "body/lattice_shares.hpp"
#include "perikit/body/partition.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

namespace {

using Cells = std::array<std::int64_t, 3>;

/// The cells of a box that a body keeps.
class KeptCells {
 public:
  KeptCells(const Lattice& lattice, const CellBox& box, const Inside& inside) : box_(box), bounds_{box.high, box.low} {
    if (inside) kept_.resize(static_cast<std::size_t>(box.cells()));
    std::size_t x = 0;
    while (lattice.axis[x] != 0) ++x;
    in_input_order(lattice, box, [&](const Cells& k) {
      if (k[x] == box.low[x]) in_rows_.push_back(0);
      if (inside) {
        const bool keep = inside(lattice.centre(k));
        kept_[at(k)] = keep;
        if (!keep) return;
      }
      ++in_rows_.back();
      for (std::size_t a = 0; a < 3; ++a)
        bounds_.low[a] = std::min(bounds_.low[a], k[a]), bounds_.high[a] = std::max(bounds_.high[a], k[a] + 1);
    });
  }
  /// The box around them.
  const CellBox& bounds() const noexcept { return bounds_; }
  /// How many there are in each row along x, in input order.
  const std::vector<std::int64_t>& in_rows() const noexcept { return in_rows_; }
  /// Of a cell of the box.
  bool holds(const Cells& k) const noexcept { return kept_.empty() || kept_[at(k)]; }

 private:
  std::size_t at(const Cells& k) const noexcept {
    return static_cast<std::size_t>(k[0] - box_.low[0] +
                                    box_.length(0) * (k[1] - box_.low[1] + box_.length(1) * (k[2] - box_.low[2])));
  }

  CellBox box_, bounds_;
  std::vector<bool> kept_;  ///< empty: all
  std::vector<std::int64_t> in_rows_;
};

/// `box` with so many cells more on all sides, in whole blocks of this size, which begin at the first cell.
CellBox grown(const Lattice& lattice, CellBox box, std::int64_t by, const Cells& block) {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t more = a < static_cast<std::size_t>(lattice.dimension) ? by : 0;
    box.low[a] = std::max<std::int64_t>(0, box.low[a] - more) / block[a] * block[a];
    box.high[a] = std::min(lattice.extent[a], (box.high[a] + more + block[a] - 1) / block[a] * block[a]);
  }
  return box;
}

/// Input numbers of the rank's own points, one after the other.
class OwnNumbers {
 public:
  /// counts: of points in each row along x of its box.
  OwnNumbers(const Lattice& lattice, const LatticeShares& shares, const std::vector<std::int64_t>& counts)
      : first_(communicator().complete() ? first_numbers_of_rows(lattice, shares.boxes(), counts) : std::vector<std::int64_t>()),
        counts_(counts) {}
  std::int64_t next() {
    while (in_row_ == counts_[row_]) ++row_, in_row_ = 0;
    return first_[row_] + in_row_++;
  }

 private:
  std::vector<std::int64_t> first_, counts_;
  std::size_t row_ = 0;
  std::int64_t in_row_ = 0;
};

}  // namespace

Partition::Partition(const BodyFrame& frame, const Lattice& lattice, const LatticeShares& shares, const Inside& inside,
                     const Reach& reach)
    : frame_(frame), lattice_(lattice), points_(shares.points()) {
  std::int64_t all = 0;
  for (const std::int64_t points : points_) all += points;
  refuse_idle(static_cast<std::size_t>(all));
  const CellBox own = shares.box(communicator().rank());
  const KeptCells kept(lattice, own, inside);
  const auto group = static_cast<std::int64_t>(padding);
  const LatticeTiling tiling(lattice);
  const auto bond = static_cast<std::int64_t>(std::floor(frame.horizon / lattice.spacing * (1 + 1e-10)));
  const Cells tile{tiling.size[0] * group, tiling.size[1], tiling.size[2]};
  const CellBox near = grown(lattice, kept.bounds(), (reach.bonds - 1) * bond, reach.blocks ? tile : Cells{1, 1, 1});
  const CellBox far = grown(lattice, near, bond, {group, 1, 1});
  constexpr std::int64_t most_cells = 2'000'000'000;  // local indices are 32 bit
  if (const std::int64_t cells = box_of(lattice, far.low, far.high, frame.horizon).cells; cells > most_cells)
    throw std::domain_error(
        fmt::format("found {} cells of the lattice on one of {} ranks; allowed: at most {}, as more ranks have", cells,
                    points_.size(), most_cells));
  LatticePart& part = lattice_part_;
  part.first = far.low;
  part.last = far.high;
  part.points_of_all_ranks = all;
  if (!inside) {
    const auto points = static_cast<std::size_t>(far.cells());
    part.places.reserve(points);
    part.roles.reserve(points);
    owner_.reserve(points);
  }
  in_input_order(lattice, far, [&](const Cells& k) {
    const bool mine = own.holds(k);
    if (mine ? !kept.holds(k) : inside && !inside(lattice.centre(k))) return;
    part.places.push_back(lattice.index(k[0], k[1], k[2]));
    part.roles.push_back(mine ? Role::own : near.holds(k) ? Role::near : Role::far);
    owner_.push_back(static_cast<std::uint16_t>(mine ? communicator().rank() : shares.owner(k)));
  });
  OwnNumbers numbers(lattice, shares, kept.in_rows());
  part.numbers.reserve(part.places.size());
  // A rank without others has numbers of cells in place of those of points.
  std::int64_t cell = 0;
  for (const Role role : part.roles)
    part.numbers.push_back(!communicator().complete() ? cell++ : role == Role::own ? numbers.next() : 0);
}

}  // namespace perikit
