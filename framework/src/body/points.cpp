#include "perikit/body/points.hpp"

#include <algorithm>
#include <utility>

namespace perikit {

Points::Points(const Body& body) : Points(std::vector<const Body*>{&body}) {}

Points::Points(std::vector<const Body*> bodies) {
  for (const Body* const body : bodies) {
    slices_.push_back({body, stride_, stride_of_all_ranks_, static_cast<std::int64_t>(size_on_all_ranks_)});
    stride_ += body->stride();
    stride_of_all_ranks_ += body->stride_of_all_ranks();
    size_on_all_ranks_ += body->points_of_all_ranks();
    spacing_ = spacing_ > 0 ? std::min(spacing_, body->spacing()) : body->spacing();
  }
  if (slices_.size() == 1) return;
  auto several = std::make_shared<Several>();
  for (const Slice& slice : slices_) {
    const auto first = static_cast<std::int32_t>(slice.first);
    for (const std::int32_t p : slice.body->internal()) several->live.push_back(first + p);
    for (const std::int32_t p : slice.body->owned()) several->owned.push_back(first + p);
    for (const std::int64_t place : slice.body->places().place) several->places.push_back(static_cast<std::int64_t>(slice.first_place) + place);
  }
  several_ = std::move(several);
}

bool Points::on_lattices() const noexcept {
  return std::ranges::all_of(slices_, [](const Slice& slice) { return slice.body->lattice() != nullptr; });
}

std::vector<std::int64_t> Points::numbers(std::span<const std::int32_t> points) const {
  std::vector<std::int64_t> numbers;
  numbers.reserve(points.size());
  for (const std::int32_t p : points) numbers.push_back(number(static_cast<std::size_t>(p)));
  return numbers;
}

}  // namespace perikit
