#include "families/blocks.hpp"

#include <algorithm>
#include <numeric>

#include "body/block_colours.hpp"

namespace perikit {

bool BlockReach::late(std::size_t b) const noexcept {
  return !elsewhere.empty() &&
         std::ranges::any_of(touches[b], [&](std::int32_t unit) { return elsewhere[static_cast<std::size_t>(unit)] != 0; });
}
std::vector<std::int32_t> free_colours(const BlockReach& reach) {
  FreeColours free(reach.units);
  std::vector<std::int32_t> colours;
  for (const std::vector<std::int32_t>& units : reach.touches) colours.push_back(free.next(std::span(units)));
  return colours;
}


BlockSequence::BlockSequence(const BlockReach& reach) : blocks_(reach.own.size()) {
  std::iota(blocks_.begin(), blocks_.end(), std::int32_t{0});
  const auto late =
      std::ranges::stable_partition(blocks_, [&](std::int32_t b) { return !reach.late(static_cast<std::size_t>(b)); });
  early_ = blocks_.size() - late.size();
}

Colouring::Colouring(const BlockReach& reach)
    : Colouring(reach, free_colours(reach), reach.units,
                [&](std::size_t b, std::vector<std::int32_t>& touched) { touched = reach.touches[b]; }) {}

Colouring::Colouring(const BlockReach& reach, const std::vector<std::int32_t>& colour_of, std::size_t cells, const Touch& touch) {
  std::vector<std::vector<std::int32_t>> of_colour;
  for (std::size_t b = 0; b < colour_of.size(); ++b) {
    const auto colour = static_cast<std::size_t>(colour_of[b]);
    if (colour >= of_colour.size()) of_colour.resize(colour + 1);
    of_colour[colour].push_back(static_cast<std::int32_t>(b));
  }
  colours_ = of_colour.size();
  // Of each cell: the block of the last colour that touches it. It has waited for those before it.
  std::vector<std::int32_t> last(cells, -1), touched;
  std::vector<std::vector<std::int32_t>> waits_for;
  for (const std::vector<std::int32_t>& colour : of_colour)
    for (const std::int32_t b : colour) {
      touched.clear();
      touch(static_cast<std::size_t>(b), touched);
      auto& before = waits_for.emplace_back();
      for (const std::int32_t cell : touched) {
        auto& of_cell = last[static_cast<std::size_t>(cell)];
        if (of_cell >= 0) before.push_back(of_cell);
        of_cell = static_cast<std::int32_t>(blocks_.size());
      }
      blocks_.push_back(b);
    }
  for (std::vector<std::int32_t>& of : waits_for) {
    std::ranges::sort(of);
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
  put_late_last(reach, waits_for);
  order_ = LoopOrder(waits_for);
}

/// Two blocks of which one waits for the other keep their order: who waits for a late block is late.
void Colouring::put_late_last(const BlockReach& reach, std::vector<std::vector<std::int32_t>>& waits_for) {
  std::vector<std::uint8_t> late(blocks_.size());
  for (std::size_t i = 0; i < late.size(); ++i)
    late[i] = reach.late(static_cast<std::size_t>(blocks_[i])) ||
              std::ranges::any_of(waits_for[i], [&](std::int32_t other) { return late[static_cast<std::size_t>(other)] != 0; });
  std::vector<std::int32_t> before(blocks_.size()), place(blocks_.size());  // the old place of a new one, and back
  std::iota(before.begin(), before.end(), std::int32_t{0});
  const auto last = std::ranges::stable_partition(before, [&](std::int32_t i) { return late[static_cast<std::size_t>(i)] == 0; });
  early_ = before.size() - last.size();
  if (last.empty()) return;
  for (std::size_t i = 0; i < before.size(); ++i) place[static_cast<std::size_t>(before[i])] = static_cast<std::int32_t>(i);
  std::vector<std::vector<std::int32_t>> wait(blocks_.size());
  std::vector<std::int32_t> blocks(blocks_.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto old = static_cast<std::size_t>(before[i]);
    blocks[i] = blocks_[old];
    wait[i] = std::move(waits_for[old]);
    for (std::int32_t& other : wait[i]) other = place[static_cast<std::size_t>(other)];
  }
  blocks_ = std::move(blocks);
  waits_for = std::move(wait);
}

}  // namespace perikit
