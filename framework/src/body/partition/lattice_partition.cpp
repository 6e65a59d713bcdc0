/// Partition of a lattice that no rank has as a whole.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "body/family_limit.hpp"
#include "body/images/lattice_images.hpp"
#include "body/partition/input_order.hpp"
#include "body/partition/partition.hpp"
#include "body/points/cell_mask.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/rank_values.hpp"

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

/// The smallest box that holds both.
CellBox joined(const CellBox& a, const CellBox& b) {
  CellBox box;
  for (std::size_t c = 0; c < 3; ++c) box.low[c] = std::min(a.low[c], b.low[c]), box.high[c] = std::max(a.high[c], b.high[c]);
  return box;
}

CellBox box_around(const Cells& k) {
  return {k, {k[0] + 1, k[1] + 1, k[2] + 1}};
}

/// The cells that a rank needs, and why.
class NeededCells {
 public:
  /// own: the cells of the rank, of which `kept` have points. images: null where there are none.
  NeededCells(const Lattice& lattice, double horizon, const CellBox& own, const KeptCells& kept, const Partition::Reach& reach,
              const LatticeImages* images)
      : near_({}, {}), all_({}, {}) {
    const auto group = static_cast<std::int64_t>(padding);
    const LatticeTiling tiling(lattice);
    const auto bond = static_cast<std::int64_t>(std::floor(family_limit(horizon / lattice.spacing)));
    const Cells one{1, 1, 1}, chunk{group, 1, 1}, tile{tiling.size[0] * group, tiling.size[1], tiling.size[2]};
    CellBox points = kept.bounds();
    std::vector<Cells> of_own;  // cells of images of own points
    if (images) {
      for (const auto& image : images->in(own)) points = joined(points, box_around(image.cell));
      in_input_order(lattice, own, [&](const Cells& k) {
        if (!images->box().holds(k) || !kept.holds(k)) return;
        const std::vector<Cells> of = images->of(k);
        of_own.insert(of_own.end(), of.begin(), of.end());
      });
    }
    const auto with_sources = [&](CellBox box) {
      if (images)
        for (const auto& image : images->in(box)) box = joined(box, box_around(image.source));
      return box;
    };
    CellBox box = points;
    for (const Cells& k : of_own) box = joined(box, box_around(k));
    box = grown(lattice, box, (reach.bonds - 1) * bond, reach.blocks ? tile : one);
    if (reach.sources) box = with_sources(box);
    // Blocks begin at the first cell of a mask.
    box = grown(lattice, with_sources(grown(lattice, box, bond, chunk)), 0, reach.blocks ? tile : chunk);
    if (images) images_ = images->in(box);
    CellMask mask(box.low, box.high);
    mask.add(points.low, points.high);
    for (const Cells& k : of_own) mask.add(k);
    const auto grow = [&](std::int64_t by) {
      for (std::size_t a = 0; a < static_cast<std::size_t>(lattice.dimension); ++a) mask.grow(a, by);
    };
    // Of images that are there, the sources are, too.
    const auto add_sources = [&] {
      for (const auto& image : images_)
        if (mask.holds(image.cell)) mask.add(image.source);
    };
    grow((reach.bonds - 1) * bond);
    if (reach.blocks) mask.fill(tile);
    if (reach.sources) add_sources();
    near_ = mask;
    grow(bond);
    mask.fill(chunk);
    add_sources();
    std::erase_if(images_, [&](const auto& image) { return !mask.holds(image.cell); });
    all_ = std::move(mask);
  }
  bool near(const Cells& k) const noexcept { return near_.holds(k); }
  bool holds(const Cells& k) const noexcept { return all_.holds(k); }
  /// The box around all of them, in whole chunks.
  CellBox bounds(const Lattice& lattice) const {
    const auto [low, high] = all_.bounds();
    return grown(lattice, {low, high}, 0, {static_cast<std::int64_t>(padding), 1, 1});
  }
  /// Ascending by number.
  const std::vector<LatticeImages::OneImage>& images() const noexcept { return images_; }

 private:
  CellMask near_, all_;
  std::vector<LatticeImages::OneImage> images_;
};

}  // namespace

Partition::Partition(const BodyFrame& frame, const Lattice& lattice, const LatticeShares& shares, const Inside& inside,
                     const Reach& reach, const LatticeImages* images)
    : frame_(frame), lattice_(lattice), points_(shares.points()) {
  std::int64_t all = 0;
  for (const std::int64_t points : points_) all += points;
  check_shares(static_cast<std::size_t>(all));
  const CellBox own = shares.box(communicator().rank());
  const KeptCells kept(lattice, own, inside);
  const NeededCells needed(lattice, frame.horizon, own, kept, reach, images);
  const CellBox box = needed.bounds(lattice);
  constexpr std::int64_t most_cells = 2'000'000'000;  // local indices are 32 bit
  if (const std::int64_t cells = box_of(lattice, box.low, box.high, frame.horizon).cells; cells > most_cells)
    throw std::domain_error(
        fmt::format("found {} cells of the lattice on one of {} ranks; allowed: at most {}, as more ranks have", cells,
                    points_.size(), most_cells));
  LatticePart& part = lattice_part_;
  part.first = box.low;
  part.last = box.high;
  part.points_of_all_ranks = all;
  if (!inside) {
    const auto points = static_cast<std::size_t>(box.cells());
    part.places.reserve(points);
    part.roles.reserve(points);
    owner_.reserve(points);
  }
  const auto add = [&](const Cells& k, Role role) {
    part.places.push_back(lattice.index(k[0], k[1], k[2]));
    part.roles.push_back(role);
    owner_.push_back(static_cast<std::uint16_t>(role == Role::own ? communicator().rank() : shares.owner(k)));
  };
  in_input_order(lattice, box, [&](const Cells& k) {
    if (!needed.holds(k)) return;
    const bool mine = own.holds(k);
    if (mine ? !kept.holds(k) : inside && !inside(lattice.centre(k))) return;
    add(k, mine ? Role::own : needed.near(k) ? Role::near : Role::far);
  });
  OwnNumbers numbers(lattice, shares, kept.in_rows());
  part.numbers.reserve(part.places.size());
  // A rank without others has numbers of cells in place of those of points.
  std::int64_t cell = 0;
  for (const Role role : part.roles)
    part.numbers.push_back(!communicator().complete() ? cell++ : role == Role::own ? numbers.next() : 0);
  if (!images) return;
  std::set<std::int64_t> taken;
  std::string overlap;
  std::int64_t own_images = 0;
  for (const LatticeImages::OneImage& image : needed.images()) {
    const Cells& k = image.cell;
    if (overlap.empty() && (images->real(k) || !taken.insert(lattice.index(k[0], k[1], k[2])).second))
      overlap = OverlappingImage(lattice.centre(k)).what();
    const bool mine = own.holds(k);
    own_images += mine;
    add(k, mine ? Role::own : own.holds(image.source) ? Role::image : needed.near(k) ? Role::near : Role::far);
    part.numbers.push_back(all + image.number);
  }
  if (const std::string first = first_message(overlap); !first.empty()) throw OverlappingImage(first);
  images_ = static_cast<std::size_t>(counted(own_images).all);
}

}  // namespace perikit
