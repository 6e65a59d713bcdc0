#include "families/blocks.hpp"

namespace perikit {

Colouring::Colouring(const BlockReach& reach) {
  // Greedy: the first colour whose blocks share no unit with this one. One bitmap of touched units per colour.
  std::vector<std::vector<bool>> used;
  for (std::size_t b = 0; b < reach.touches.size(); ++b) {
    std::size_t colour = 0;
    for (; colour < used.size(); ++colour) {
      bool clash = false;
      for (const std::int32_t unit : reach.touches[b]) {
        if (used[colour][static_cast<std::size_t>(unit)]) {
          clash = true;
          break;
        }
      }
      if (!clash) break;
    }
    if (colour == used.size()) {
      used.emplace_back(reach.units, false);
      colours_.emplace_back();
    }
    for (const std::int32_t unit : reach.touches[b]) used[colour][static_cast<std::size_t>(unit)] = true;
    colours_[colour].push_back(static_cast<std::int32_t>(b));
  }
}

}  // namespace perikit
