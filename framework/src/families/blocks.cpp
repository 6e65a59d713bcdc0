#include "families/blocks.hpp"

#include "perikit/body/body.hpp"

namespace perikit {

Colouring::Colouring(const BlockReach& reach) : Colouring(block_colours(reach.touches, reach.units)) {}

Colouring::Colouring(const std::vector<std::int32_t>& colour_of) {
  for (std::size_t b = 0; b < colour_of.size(); ++b) {
    const auto colour = static_cast<std::size_t>(colour_of[b]);
    if (colour >= colours_.size()) colours_.resize(colour + 1);
    colours_[colour].push_back(static_cast<std::int32_t>(b));
  }
}

}  // namespace perikit
