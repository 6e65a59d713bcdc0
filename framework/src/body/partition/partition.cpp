#include "body/partition/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "body/partition/block_colours.hpp"
#include "body/points/curve.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// The pieces of the whole cloud; padding makes no further block.
CurveShares pieces_of(const Body& part) {
  return {static_cast<std::int64_t>(part.stride_of_all_ranks()), communicator().size()};
}

}  // namespace

void Partition::check_shares(std::size_t real) const {
  constexpr std::size_t most = std::numeric_limits<std::uint16_t>::max();
  if (points_.size() > most) throw std::domain_error(fmt::format("found {} ranks; allowed: at most {}", points_.size(), most));
  if (std::ranges::find(points_, 0) == points_.end()) return;
  throw std::domain_error(
      fmt::format("found {} ranks for a body of {} points, which is shared out in blocks of points that are "
                  "evaluated together; allowed: fewer ranks, and threads on each (--threads)",
                  points_.size(), real));
}

Body Partition::make_part(std::uint16_t far_material) {
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

std::size_t Partition::owner(const Body& part, std::int32_t p) const {
  const auto at = static_cast<std::size_t>(p);
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
