#include "perikit/body/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "body/cell_mask.hpp"
#include "body/lattice_shares.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

using Cells = std::array<std::int64_t, 3>;

/// Sizes of the blocks of points that loops over clouds run over; the first is a multiple of the others.
constexpr std::size_t cloud_blocks[] = {64, 32};

}  // namespace

namespace {

std::size_t count_of_ranks() {
  const int size = communicator().size();
  constexpr int most = std::numeric_limits<std::uint16_t>::max();
  if (size > most) throw std::domain_error(fmt::format("found {} ranks; allowed: {} of them", size, most));
  return static_cast<std::size_t>(size);
}

}  // namespace

Partition::Partition(Body whole, const Reach& reach, std::vector<std::int32_t> sources)
    : whole_(std::move(whole)),
      sources_(std::move(sources)),
      images_(sources_.size()),
      owner_(whole_->points(), 0),
      points_(count_of_ranks(), 0) {
  const auto size = static_cast<int>(points_.size());
  whole_->lattice() ? share_lattice(size) : share_cloud(size);
  const std::size_t real = whole_->points_of_all_ranks();
  for (std::size_t n = 0; n < real; ++n) ++points_[static_cast<std::size_t>(owner_[n])];
  refuse_idle(real);
  part_.roles.assign(whole_->points(), Role::absent);
  for (std::size_t n = 0; n < owner_.size(); ++n)
    if (owner_[n] == communicator().rank()) part_.roles[n] = Role::own;
  choose_images();
  whole_->lattice() ? keep_cells(reach) : keep_families(reach);
}

void Partition::refuse_idle(std::size_t real) const {
  if (std::ranges::find(points_, 0) == points_.end()) return;
  throw std::domain_error(
      fmt::format("found {} ranks for a body of {} points, which is shared out in blocks of points that are "
                  "evaluated together; allowed: fewer ranks, and threads on each (--threads)",
                  points_.size(), real));
}

Body Partition::make_part(std::uint16_t far_material) {
  if (whole_) {
    const BodyPart part = std::move(part_);
    Body body(*whole_, part, far_material);
    exchange_borders(body);
    owner_ = {};
    return body;
  }
  Body body(std::move(frame_), lattice_, std::move(lattice_part_), far_material);
  exchange_borders(body);
  exchange_numbers(body);
  owner_ = {};
  return body;
}

void Partition::share_lattice(int size) {
  const Lattice& lattice = *whole_->lattice();
  const LatticeTiling tiling(lattice);
  std::vector<std::int64_t> points(static_cast<std::size_t>(tiling.tiles()), 0);
  for (const std::int32_t p : whole_->owned()) ++points[static_cast<std::size_t>(tiling.number(tiling.of(lattice.cell(p))))];
  const LatticeShares shares(lattice, std::move(points), size);
  for (std::size_t n = 0; n < owner_.size(); ++n)
    owner_[n] = static_cast<std::uint16_t>(shares.owner(lattice.cell(whole_->internal()[n])));
}

/// Pieces of the curve that orders the points.
void Partition::share_cloud(int size) {
  const std::size_t block = cloud_blocks[0], blocks = (whole_->points() + block - 1) / block;
  for (std::size_t n = 0; n < owner_.size(); ++n) {
    const std::size_t b = static_cast<std::size_t>(whole_->internal()[n]) / block;
    owner_[n] = static_cast<std::uint16_t>(b * static_cast<std::size_t>(size) / blocks);
  }
}

template <class Visit>
void Partition::over_images(Visit&& visit) const {
  const std::size_t real = whole_->points() - sources_.size();
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
  const Lattice& lattice = *whole_->lattice();
  const LatticeTiling tiling(lattice);
  const auto group = static_cast<std::int64_t>(padding);
  const auto cell = [&](std::size_t n) { return lattice.cell(whole_->internal()[n]); };
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
  const auto bond = static_cast<std::int64_t>(std::floor(whole_->horizon() / lattice.spacing * (1 + 1e-10)));
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
  const std::size_t points = whole_->points();
  std::vector<std::uint8_t> reached(points, 0);  // by internal index
  const auto at = [&](std::size_t n) -> std::uint8_t& { return reached[static_cast<std::size_t>(whole_->internal()[n])]; };
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
    reached = with_families(whole_->rows(), points, whole_->dimension(), whole_->horizon(), std::move(reached));
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
    const auto touches = block_reach(*whole_, block);
    const std::vector<std::int32_t> colours = block_colours(touches, touches.size());
    for (std::size_t b = 0; b < colours.size(); ++b)
      if (reached[b * block]) part_.colours[block].push_back(colours[b]);
  }
}

/// Each rank tells the owners of its ghosts which they are, by their places in the whole body.
void Partition::exchange_borders(const Body& part) {
  const auto size = points_.size();
  const auto me = static_cast<std::size_t>(communicator().rank());
  lent_.resize(size);
  borrowed_.resize(size);
  std::vector<std::vector<double>> to(size), from(size);
  for (std::size_t n = 0; n < part.points(); ++n) {
    const std::int32_t p = part.internal()[n];
    const auto number = static_cast<std::size_t>(part.number(static_cast<std::size_t>(p)));
    const std::size_t owner = owner_[whole_ ? number : n];
    if (owner == me) continue;
    borrowed_[owner].push_back(p);
    to[owner].push_back(static_cast<double>(part.places().place[static_cast<std::size_t>(p)]));
  }
  std::vector<double> asked(size), wanted(size);
  for (std::size_t k = 0; k < size; ++k) asked[k] = static_cast<double>(to[k].size());
  std::vector<Message> messages;
  for (std::size_t k = 0; k < size; ++k)
    if (k != me) messages.push_back({static_cast<int>(k), {&asked[k], 1}, {&wanted[k], 1}});
  communicator().exchange(messages);
  messages.clear();
  for (std::size_t k = 0; k < size; ++k) {
    from[k].resize(static_cast<std::size_t>(wanted[k]));
    if (!to[k].empty() || !from[k].empty()) messages.push_back({static_cast<int>(k), to[k], from[k]});
  }
  communicator().exchange(messages);
  for (std::size_t k = 0; k < size; ++k)
    for (const double place : from[k]) lent_[k].push_back(part.at_place(static_cast<std::int64_t>(place)));
}

/// Owners know the input numbers of their points.
void Partition::exchange_numbers(Body& part) const {
  if (!communicator().complete()) return;
  const auto size = points_.size();
  std::vector<std::vector<double>> to(size), from(size);
  std::vector<Message> messages;
  for (std::size_t k = 0; k < size; ++k) {
    for (const std::int32_t p : lent_[k]) to[k].push_back(static_cast<double>(part.number(static_cast<std::size_t>(p))));
    from[k].resize(borrowed_[k].size());
    if (!to[k].empty() || !from[k].empty()) messages.push_back({static_cast<int>(k), to[k], from[k]});
  }
  communicator().exchange(messages);
  for (std::size_t k = 0; k < size; ++k)
    for (std::size_t n = 0; n < from[k].size(); ++n)
      part.set_number(static_cast<std::size_t>(borrowed_[k][n]), static_cast<std::int64_t>(from[k][n]));
}

}  // namespace perikit
