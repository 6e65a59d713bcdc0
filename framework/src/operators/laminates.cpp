#include "operators/laminates.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

double interface_value(const Interfaces& interfaces, std::size_t interface, std::size_t point, InterfaceValue what) noexcept {
  const Interface& of = interfaces.all[interface];
  const std::uint16_t material = interfaces.material[point];
  const std::ptrdiff_t at = of.find(static_cast<std::int32_t>(point));
  if (what == InterfaceValue::others) {
    // No two points the same, so that they do not cancel.
    const bool known = (material == of.first || material == of.second) && at >= 0;
    return known ? 0.0 : interfaces.length * (1.0 + std::fmod(static_cast<double>(point) * 0.6180339887498949, 1.0));
  }
  if (at < 0) return 0;
  const double distance = of.distance[static_cast<std::size_t>(at)];
  return std::max(0.0, what == InterfaceValue::plus ? distance : -distance);
}

bool sees(int dimension, const double* gradient) noexcept {
  for (int e = 0; e < dimension; ++e)
    if (std::abs(gradient[e]) > 1e-9) return true;
  return false;
}

void set_points(const Interfaces& interfaces, std::size_t interface, std::int32_t owner, LaminatePoint& out) noexcept {
  const Interface& of = interfaces.all[interface];
  out.material[0] = of.first;
  out.material[1] = of.second;
  const std::ptrdiff_t at = of.find(owner);
  const bool in_first = interfaces.material[static_cast<std::size_t>(owner)] == of.first;
  out.point[in_first ? 0 : 1] = interfaces.source[static_cast<std::size_t>(owner)];
  out.point[in_first ? 1 : 0] = at < 0 ? -1 : of.counterpart[static_cast<std::size_t>(at)];
}

bool find_laminate(int dimension, const double (&gradient)[interface_values][3], LaminatePoint& out) noexcept {
  const auto of = [&](InterfaceValue what) { return gradient[static_cast<int>(what)]; };
  if (!sees(dimension, of(InterfaceValue::plus)) || !sees(dimension, of(InterfaceValue::minus))) return false;
  if (sees(dimension, of(InterfaceValue::others))) return false;
  return make_laminate(dimension, of(InterfaceValue::plus), of(InterfaceValue::minus), out);
}

Laminates::Laminates(std::shared_ptr<const Interfaces> interfaces, std::size_t points, std::size_t numbers)
    : interfaces_(std::move(interfaces)), near_(points / padding, 0), group_(numbers / padding + 1, -1) {
  for (const Interface& interface : interfaces_->all)
    for (const std::int32_t p : interface.point) near_[static_cast<std::size_t>(p) / padding] = whole_group;
}

void Laminates::set(std::int64_t number, const LaminatePoint& point) {
  std::int32_t& group = group_[static_cast<std::size_t>(number) / padding];
  if (group < 0) {
    group = static_cast<std::int32_t>(point_.size() / padding);
    point_.resize(point_.size() + padding);
  }
  point_[static_cast<std::size_t>(group) * padding + static_cast<std::size_t>(number) % padding] = point;
}

void Laminates::clear(std::int64_t number) noexcept {
  const std::int32_t group = group_[static_cast<std::size_t>(number) / padding];
  if (group >= 0) point_[static_cast<std::size_t>(group) * padding + static_cast<std::size_t>(number) % padding].share = -1;
}

std::size_t Laminates::count() const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(point_, [](const LaminatePoint& p) { return p.share >= 0; }));
}

std::size_t Laminates::bytes() const noexcept {
  return near_.size() + group_.size() * sizeof(std::int32_t) + point_.capacity() * sizeof(LaminatePoint);
}

}  // namespace perikit
