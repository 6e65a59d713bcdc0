#include "perikit/operators/law_history.hpp"

#include <algorithm>

namespace perikit {

void LawHistory::allocate() {
  first_.assign(1, 0);
  for (const std::size_t lanes : lanes_) first_.push_back(first_.back() + lanes);
  lanes_ = {};
  begin_.assign(first_.back() * components_, 0.0);
  end_ = begin_;
  allocated_ = true;
}

LawHistory::Place LawHistory::next(std::size_t block, std::size_t& cursor, int lanes) noexcept {
  const std::size_t stride = padded(static_cast<std::size_t>(lanes)), at = cursor;
  cursor += stride;
  if (!allocated_) {
    lanes_[block] = std::max(lanes_[block], cursor);
    return {};
  }
  const std::size_t offset = (first_[block] + at) * components_;
  return {begin_.data() + offset, time_step_ > 0 ? end_.data() + offset : nullptr, stride};
}

}  // namespace perikit
