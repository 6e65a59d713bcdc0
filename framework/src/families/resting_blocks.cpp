#include "families/resting_blocks.hpp"

#include <algorithm>

namespace perikit {

void RestingBlocks::begin(int passes) {
  distance_.swap(before_);
  passes_before_ = passes_;
  passes_ = passes;
}

void RestingBlocks::wake() {
  if (distance_.empty()) return;
  begin(passes_);
  wake_all();
}

void RestingBlocks::wake_all() { std::fill(distance_.begin(), distance_.end(), std::uint8_t{0}); }

void RestingBlocks::spread() {
  for (int step = 1; step <= passes_ && quiet() > 0; ++step) {
    reached_.assign(reach_.units, 0);
    for (std::size_t b = 0; b < distance_.size(); ++b)
      if (distance_[b] < step) reached_[static_cast<std::size_t>(reach_.own[b])] = 1;
    for (std::size_t b = 0; b < distance_.size(); ++b) {
      if (distance_[b] != far) continue;
      const auto& near = reach_.touches[b];
      if (std::any_of(near.begin(), near.end(), [&](std::int32_t unit) { return reached_[static_cast<std::size_t>(unit)] != 0; }))
        distance_[b] = static_cast<std::uint8_t>(step);
    }
  }
  count();
}

bool RestingBlocks::moves(ConstFieldView u, std::size_t begin, std::size_t end) noexcept {
  for (int c = 0; c < u.components; ++c) {
    const double* x = u.component(c);
    bool any = false;
    for (std::size_t p = begin; p < end; ++p) any |= x[p] != 0;
    if (any) return true;
  }
  return false;
}

}  // namespace perikit
