#include "perikit/body/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "body/cell_mask.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

using Cells = std::array<std::int64_t, 3>;

/// Sizes of the blocks of points that loops over clouds run over; the first is a multiple of the others.
constexpr std::size_t cloud_blocks[] = {256, 64};

/// Ranks first ... first + ranks - 1 get the tiles low ... high - 1: cut across the longest side, near where the points divide as
/// the ranks.
class Bisection {
 public:
  Bisection(const LatticeTiling& tiling, const std::vector<std::int64_t>& points)
      : tiling_(tiling), points_(points), rank_(points.size(), 0) {}

  void share(Cells low, Cells high, int first, int ranks) {
    if (ranks == 1) return each(low, high, [&](std::size_t tile) { rank_[tile] = first; });
    std::size_t axis = 3;
    std::int64_t longest = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t length = (high[a] - low[a]) * tiling_.size[a] * (a == 0 ? static_cast<std::int64_t>(padding) : 1);
      if (high[a] - low[a] > 1 && length > longest) axis = a, longest = length;
    }
    if (axis == 3) return;  // one tile for several ranks: one of them is left without points
    const int lower = ranks / 2;
    const double wanted = static_cast<double>(count(low, high)) * lower / ranks;
    std::int64_t cut = low[axis] + 1;
    double nearest = -1;
    for (std::int64_t k = low[axis] + 1; k < high[axis]; ++k) {
      Cells end = high;
      end[axis] = k;
      const double off = std::abs(static_cast<double>(count(low, end)) - wanted);
      if (nearest < 0 || off < nearest) cut = k, nearest = off;
    }
    Cells middle_high = high, middle_low = low;
    middle_high[axis] = middle_low[axis] = cut;
    share(low, middle_high, first, lower);
    share(middle_low, high, first + lower, ranks - lower);
  }
  int rank(std::size_t tile) const noexcept { return rank_[tile]; }

 private:
  template <class Use>
  void each(const Cells& low, const Cells& high, Use&& use) const {
    for (std::int64_t c = low[2]; c < high[2]; ++c)
      for (std::int64_t b = low[1]; b < high[1]; ++b)
        for (std::int64_t a = low[0]; a < high[0]; ++a) use(static_cast<std::size_t>(tiling_.number({a, b, c})));
  }
  std::int64_t count(const Cells& low, const Cells& high) const {
    std::int64_t sum = 0;
    each(low, high, [&](std::size_t tile) { sum += points_[tile]; });
    return sum;
  }

  const LatticeTiling& tiling_;
  const std::vector<std::int64_t>& points_;
  std::vector<int> rank_;
};

}  // namespace

Partition::Partition(Body whole, const Reach& reach, std::vector<std::int32_t> sources)
    : whole_(std::move(whole)), sources_(std::move(sources)), owner_(whole_.points(), 0) {
  const int size = communicator().size();
  if (size > std::numeric_limits<std::uint16_t>::max()) throw std::domain_error(fmt::format("found {} ranks; allowed: {} of them", size, std::numeric_limits<std::uint16_t>::max()));
  whole_.lattice() ? share_lattice(size) : share_cloud(size);
  points_.assign(static_cast<std::size_t>(size), 0);
  const std::size_t real = whole_.points_of_all_ranks();
  for (std::size_t n = 0; n < real; ++n) ++points_[static_cast<std::size_t>(owner_[n])];
  if (std::ranges::find(points_, 0) != points_.end())
    throw std::domain_error(
        fmt::format("found {} ranks for a body of {} points, which is shared out in blocks of points that are "
                    "evaluated together; allowed: fewer ranks, and threads on each (--threads)",
                    size, real));
  part_.roles.assign(whole_.points(), Role::absent);
  for (std::size_t n = 0; n < owner_.size(); ++n)
    if (owner_[n] == communicator().rank()) part_.roles[n] = Role::own;
  choose_images();
  whole_.lattice() ? keep_cells(reach) : keep_families(reach);
  exchange_borders();
}

Body Partition::make_part(std::uint16_t far_material) {
  const BodyPart part = std::move(part_);
  return Body(whole_, part, far_material);
}

void Partition::share_lattice(int size) {
  const Lattice& lattice = *whole_.lattice();
  const LatticeTiling tiling(lattice);
  const auto tile = [&](std::int32_t p) { return static_cast<std::size_t>(tiling.number(tiling.of(lattice.cell(p)))); };
  std::vector<std::int64_t> points(static_cast<std::size_t>(tiling.tiles()), 0);
  for (const std::int32_t p : whole_.owned()) ++points[tile(p)];
  Bisection bisection(tiling, points);
  bisection.share({}, tiling.count, 0, size);
  for (std::size_t n = 0; n < owner_.size(); ++n) owner_[n] = static_cast<std::uint16_t>(bisection.rank(tile(whole_.internal()[n])));
}

/// Pieces of the curve that orders the points.
void Partition::share_cloud(int size) {
  const std::size_t block = cloud_blocks[0], blocks = (whole_.points() + block - 1) / block;
  for (std::size_t n = 0; n < owner_.size(); ++n) {
    const std::size_t b = static_cast<std::size_t>(whole_.internal()[n]) / block;
    owner_[n] = static_cast<std::uint16_t>(b * static_cast<std::size_t>(size) / blocks);
  }
}

template <class Visit>
void Partition::over_images(Visit&& visit) const {
  const std::size_t real = whole_.points() - sources_.size();
  for (std::size_t k = 0; k < sources_.size(); ++k) visit(real + k, static_cast<std::size_t>(sources_[k]));
}

/// Forces on images are forces on their sources.
void Partition::choose_images() {
  over_images([&](std::size_t image, std::size_t source) {
    if (part_.roles[source] == Role::own) part_.roles[image] = std::max(part_.roles[image], Role::image);
  });
}

/// Cells within reach of the box of the owned ones and of the images of these.
void Partition::keep_cells(const Reach& reach) {
  const Lattice& lattice = *whole_.lattice();
  const LatticeTiling tiling(lattice);
  const auto group = static_cast<std::int64_t>(padding);
  const auto cell = [&](std::size_t n) { return lattice.cell(whole_.internal()[n]); };
  CellMask mask(lattice.extent);
  Cells low = lattice.extent, high{};
  for (std::size_t n = 0; n < owner_.size(); ++n) {
    if (part_.roles[n] != Role::own) continue;
    const Cells k = cell(n);
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], k[a]), high[a] = std::max(high[a], k[a] + 1);
  }
  mask.add(low, high);
  for (std::size_t n = 0; n < owner_.size(); ++n)
    if (part_.roles[n] == Role::image) mask.add(cell(n));
  const auto bond = static_cast<std::int64_t>(std::floor(whole_.horizon() / lattice.spacing * (1 + 1e-10)));
  const auto grow = [&](std::int64_t by) {
    for (std::size_t a = 0; a < static_cast<std::size_t>(lattice.dimension); ++a) mask.grow(a, by);
  };
  const auto keep = [&](Role role) {
    for (std::size_t n = 0; n < owner_.size(); ++n)
      if (mask.holds(cell(n))) part_.roles[n] = std::max(part_.roles[n], role);
  };
  // Of images that are there, the sources are, too.
  const auto add_sources = [&] {
    over_images([&](std::size_t image, std::size_t source) {
      if (mask.holds(cell(image))) mask.add(cell(source));
    });
  };
  grow((reach.bonds - 1) * bond);
  if (reach.blocks) mask.fill({tiling.size[0] * group, tiling.size[1], tiling.size[2]});
  if (reach.sources) add_sources();
  keep(Role::near);
  grow(bond);
  mask.fill({group, 1, 1});
  add_sources();
  keep(Role::far);
  std::tie(part_.first, part_.last) = mask.bounds();
  part_.first[0] = part_.first[0] / group * group;
  part_.last[0] = std::min(lattice.extent[0], (part_.last[0] + group - 1) / group * group);
}

/// Points that bonds lead to, in whole blocks.
void Partition::keep_families(const Reach& reach) {
  const std::size_t points = whole_.points();
  std::vector<std::uint8_t> reached(points, 0);  // by internal index
  const auto at = [&](std::size_t n) -> std::uint8_t& { return reached[static_cast<std::size_t>(whole_.internal()[n])]; };
  const auto mark = [&](Role role) {
    for (std::size_t n = 0; n < points; ++n)
      if (at(n)) part_.roles[n] = std::max(part_.roles[n], role);
  };
  const auto fill_blocks = [&] {
    for (std::size_t b = 0; b < points; b += cloud_blocks[0]) {
      const auto begin = reached.begin() + static_cast<std::ptrdiff_t>(b),
                 end = reached.begin() + static_cast<std::ptrdiff_t>(std::min(points, b + cloud_blocks[0]));
      if (std::find(begin, end, 1) != end) std::fill(begin, end, std::uint8_t{1});
    }
  };
  const auto step = [&] {
    reached = with_families(whole_.rows(), points, whole_.dimension(), whole_.horizon(), std::move(reached));
  };
  for (std::size_t n = 0; n < points; ++n) at(n) = part_.roles[n] >= Role::image;
  for (int k = 1; k < reach.bonds; ++k) step();
  if (reach.blocks) fill_blocks();
  // Of images that are there, the sources are, too.
  bool more = false;
  const auto add_sources = [&] {
    more = false;
    over_images([&](std::size_t image, std::size_t source) {
      if (!at(image) || at(source)) return;
      at(source) = 1;
      more = true;
    });
  };
  if (reach.sources) add_sources();
  mark(Role::near);
  step();
  do {
    fill_blocks();
    add_sources();
  } while (more);
  mark(Role::far);
  for (const std::size_t block : cloud_blocks) {
    const auto touches = block_reach(whole_, block);
    const std::vector<std::int32_t> colours = block_colours(touches, touches.size());
    for (std::size_t b = 0; b < colours.size(); ++b)
      if (reached[b * block]) part_.colours[block].push_back(colours[b]);
  }
}

/// Each rank tells the owners of its ghosts which they are.
void Partition::exchange_borders() {
  const auto size = points_.size();
  lent_.resize(size);
  borrowed_.resize(size);
  for (std::size_t n = 0; n < owner_.size(); ++n)
    if (part_.roles[n] != Role::absent && part_.roles[n] != Role::own)
      borrowed_[static_cast<std::size_t>(owner_[n])].push_back(static_cast<std::int32_t>(n));
  std::vector<std::vector<double>> to(size), from(size);
  std::vector<double> asked(size), wanted(size);
  const auto exchange = [&](auto&& outgoing, auto&& incoming) {
    std::vector<Message> messages;
    for (std::size_t k = 0; k < size; ++k)
      if (static_cast<int>(k) != communicator().rank()) messages.push_back({static_cast<int>(k), outgoing(k), incoming(k)});
    communicator().exchange(messages);
  };
  for (std::size_t k = 0; k < size; ++k) {
    to[k].assign(borrowed_[k].begin(), borrowed_[k].end());
    asked[k] = static_cast<double>(to[k].size());
  }
  exchange([&](std::size_t k) { return std::span<const double>(&asked[k], 1); },
           [&](std::size_t k) { return std::span(&wanted[k], 1); });
  for (std::size_t k = 0; k < size; ++k) from[k].resize(static_cast<std::size_t>(wanted[k]));
  exchange([&](std::size_t k) { return std::span<const double>(to[k]); }, [&](std::size_t k) { return std::span(from[k]); });
  for (std::size_t k = 0; k < size; ++k)
    for (const double number : from[k]) lent_[k].push_back(static_cast<std::int32_t>(number));
}

}  // namespace perikit
