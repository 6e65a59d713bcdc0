#include "perikit/body/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "body/block_colours.hpp"
#include "body/cell_mask.hpp"
#include "body/curve.hpp"
#include "body/lattice_shares.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

using Cells = std::array<std::int64_t, 3>;

std::size_t count_of_ranks() {
  const int size = communicator().size();
  constexpr int most = std::numeric_limits<std::uint16_t>::max();
  if (size > most) throw std::domain_error(fmt::format("found {} ranks; allowed: {} of them", size, most));
  return static_cast<std::size_t>(size);
}

/// The pieces of the whole cloud; padding makes no further block.
CurveShares pieces_of(const Body& part) {
  return {static_cast<std::int64_t>(part.stride_of_all_ranks()), communicator().size()};
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
    return finished(Body(*whole_, part, far_material));
  }
  if (!cloud_part_.places.empty()) return finished(Body(std::move(frame_), std::move(cloud_part_), far_material));
  Body body = finished(Body(std::move(frame_), lattice_, std::move(lattice_part_), far_material));
  exchange_numbers(body);
  return body;
}

/// What ranks have to tell each other of the parts that they have placed.
Body Partition::finished(Body part) {
  exchange_borders(part);
  owner_ = {};
  if (part.lattice()) return part;
  colour_blocks(pieces_of(part), part);
  return part;
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

void Partition::share_cloud(int size) {
  const CurveShares pieces(static_cast<std::int64_t>(whole_->points()), size);
  for (std::size_t n = 0; n < owner_.size(); ++n) owner_[n] = static_cast<std::uint16_t>(pieces.owner(whole_->internal()[n]));
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
  CellMask mask({}, lattice.extent);
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
  const auto step = [&] {
    reached = with_families(whole_->rows(), points, whole_->dimension(), whole_->horizon(), std::move(reached));
  };
  for (std::size_t n = 0; n < points; ++n) at(n) = part_.roles[n] >= Role::image;
  for (int k = 1; k < reach.bonds; ++k) step();
  if (reach.blocks) fill_blocks(whole_->block_points(), reached);
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
    fill_blocks(whole_->block_points(), reached);
    add_sources();
  } while (more);
  mark(Role::far);
}

std::size_t Partition::owner(const Body& part, std::int32_t p) const {
  const auto at = static_cast<std::size_t>(p);
  if (whole_) return owner_[static_cast<std::size_t>(part.number(at))];
  if (part.lattice()) return owner_[static_cast<std::size_t>(part.input_of(at))];
  return static_cast<std::size_t>(pieces_of(part).owner(part.places().place[at]));
}

/// Each rank tells the owners of its ghosts which they are, by their places in the whole body.
void Partition::exchange_borders(const Body& part) {
  const auto size = points_.size();
  const auto me = static_cast<std::size_t>(communicator().rank());
  lent_.resize(size);
  borrowed_.resize(size);
  std::vector<std::vector<std::int64_t>> places(size);
  for (const std::int32_t p : part.internal()) {
    const std::size_t of = owner(part, p);
    if (of == me) continue;
    borrowed_[of].push_back(p);
    places[of].push_back(part.places().place[static_cast<std::size_t>(p)]);
  }
  const std::vector<std::vector<std::int64_t>> wanted = exchanged(places);
  for (std::size_t k = 0; k < size; ++k)
    for (const std::int64_t place : wanted[k]) lent_[k].push_back(part.at_place(place));
}

/// Owners know the input numbers of their points.
void Partition::exchange_numbers(Body& part) const {
  if (!communicator().complete()) return;
  std::vector<std::vector<std::int64_t>> mine(points_.size());
  for (std::size_t k = 0; k < mine.size(); ++k)
    for (const std::int32_t p : lent_[k]) mine[k].push_back(part.number(static_cast<std::size_t>(p)));
  const std::vector<std::vector<std::int64_t>> numbers = exchanged(mine);
  for (std::size_t k = 0; k < numbers.size(); ++k)
    for (std::size_t n = 0; n < numbers[k].size(); ++n) part.set_number(static_cast<std::size_t>(borrowed_[k][n]), numbers[k][n]);
}

}  // namespace perikit
