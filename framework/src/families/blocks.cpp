#include "families/blocks.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "body/partition/block_colours.hpp"
#include "core/each_once.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

bool BlockReach::late(std::size_t b) const noexcept {
  return !elsewhere.empty() &&
         std::ranges::any_of(touches[b], [&](std::int32_t unit) { return elsewhere[static_cast<std::size_t>(unit)] != 0; });
}

std::vector<std::uint8_t> arriving_points(const Body& body) {
  if (!body.part()) return {};
  std::vector<std::uint8_t> arriving(body.stride(), 0);
  for (const std::int32_t p : body.internal()) arriving[static_cast<std::size_t>(p)] = 1;
  for (const std::int32_t p : body.owned()) arriving[static_cast<std::size_t>(p)] = 0;
  return arriving;
}

std::vector<std::int32_t> free_colours(const BlockReach& reach) {
  FreeColours free(reach.units);
  std::vector<std::int32_t> colours;
  for (const std::vector<std::int32_t>& units : reach.touches) colours.push_back(free.next(std::span(units)));
  return colours;
}

BlockSequence::BlockSequence(const BlockReach& reach) : blocks_(reach.own.size()) {
  std::iota(blocks_.begin(), blocks_.end(), std::int32_t{0});
  const auto late = std::stable_partition(blocks_.begin(), blocks_.end(), [&](std::int32_t b) { return !reach.late(static_cast<std::size_t>(b)); });
  early_ = static_cast<std::size_t>(late - blocks_.begin());
}

Colouring::Colouring(const BlockReach& reach)
    : Colouring(reach, free_colours(reach), reach.units,
                [&](std::size_t b, std::vector<std::int32_t>& touched) { touched = reach.touches[b]; }) {}

/// Of two blocks that touch a cell the one of the higher colour waits for the other. Who waits for a late block is late.
Colouring::Colouring(const BlockReach& reach, const std::vector<std::int32_t>& colour_of, std::size_t cells, const Touch& touch) {
  std::vector<std::vector<std::int32_t>> of_colour;
  LoopWaits waits_for(colour_of.size());
  for (std::size_t b = 0; b < colour_of.size(); ++b) {
    const auto colour = static_cast<std::size_t>(colour_of[b]);
    if (colour >= of_colour.size()) of_colour.resize(colour + 1);
    of_colour[colour].push_back(static_cast<std::int32_t>(b));
  }
  colours_ = of_colour.size();
  // Of each cell: the block of the last colour that touches it. It has waited for those before it.
  std::vector<std::int32_t> last(cells, -1), touched;
  std::vector<std::uint8_t> late(colour_of.size());
  for (const std::vector<std::int32_t>& colour : of_colour)
    for (const std::int32_t b : colour) {
      touched.clear();
      touch(static_cast<std::size_t>(b), touched);
      auto& before = waits_for[static_cast<std::size_t>(b)];
      for (const std::int32_t cell : touched)
        if (const std::int32_t other = std::exchange(last[static_cast<std::size_t>(cell)], b); other >= 0)
          before.push_back(other);
      keep_each_once(before);
      late[static_cast<std::size_t>(b)] =
          reach.late(static_cast<std::size_t>(b)) ||
          std::ranges::any_of(before, [&](std::int32_t other) { return late[static_cast<std::size_t>(other)] != 0; });
    }
  order_ = std::make_unique<LoopOrder>(std::make_shared<const LoopWaits>(std::move(waits_for)), std::move(late));
}

}  // namespace perikit
