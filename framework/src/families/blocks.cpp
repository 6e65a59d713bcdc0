#include "families/blocks.hpp"

#include <algorithm>

#include "perikit/body/body.hpp"

namespace perikit {

Colouring::Colouring(const BlockReach& reach)
    : Colouring(block_colours(reach.touches, reach.units), reach.units,
                [&](std::size_t b, std::vector<std::int32_t>& touched) { touched = reach.touches[b]; }) {}

Colouring::Colouring(const std::vector<std::int32_t>& colour_of, std::size_t cells, const Touch& touch) {
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
  order_ = LoopOrder(waits_for);
}

}  // namespace perikit
