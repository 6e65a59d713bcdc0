#include "families/blocks.hpp"

#include <algorithm>

#include "body/block_colours.hpp"

namespace perikit {

namespace {

std::vector<std::int32_t> colours_of(const BlockReach& reach) {
  FreeColours free(reach.units);
  std::vector<std::int32_t> colours;
  for (const std::vector<std::int32_t>& units : reach.touches) colours.push_back(free.next(std::span(units)));
  return colours;
}

}  // namespace

Colouring::Colouring(const BlockReach& reach) : Colouring(reach, colours_of(reach)) {}

Colouring::Colouring(const BlockReach& reach, const std::vector<std::int32_t>& colour_of) {
  std::vector<std::vector<std::int32_t>> of_colour;
  for (std::size_t b = 0; b < colour_of.size(); ++b) {
    const auto colour = static_cast<std::size_t>(colour_of[b]);
    if (colour >= of_colour.size()) of_colour.resize(colour + 1);
    of_colour[colour].push_back(static_cast<std::int32_t>(b));
  }
  colours_ = of_colour.size();
  // Of each unit: the blocks of the last colour that touches it. They have waited for those before them.
  std::vector<std::vector<std::int32_t>> last(reach.units), waits_for;
  for (const std::vector<std::int32_t>& colour : of_colour) {
    const std::size_t first = blocks_.size();
    const auto each_unit = [&](auto&& visit) {
      for (std::size_t i = first; i < blocks_.size(); ++i)
        for (const std::int32_t unit : reach.touches[static_cast<std::size_t>(blocks_[i])]) visit(i, last[static_cast<std::size_t>(unit)]);
    };
    blocks_.insert(blocks_.end(), colour.begin(), colour.end());
    waits_for.resize(blocks_.size());
    each_unit([&](std::size_t i, const std::vector<std::int32_t>& before) { waits_for[i].insert(waits_for[i].end(), before.begin(), before.end()); });
    each_unit([&](std::size_t, std::vector<std::int32_t>& of) { of.clear(); });
    each_unit([&](std::size_t i, std::vector<std::int32_t>& of) { of.push_back(static_cast<std::int32_t>(i)); });
  }
  for (std::vector<std::int32_t>& of : waits_for) {
    std::ranges::sort(of);
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
  order_ = LoopOrder(waits_for);
}

}  // namespace perikit
