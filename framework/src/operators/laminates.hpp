#pragma once
/// Which evaluation points of a space are laminates, by their stable numbers (spaces/find_laminates.hpp).

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "body/interfaces.hpp"
#include "core/group_marks.hpp"
#include "operators/laminate.hpp"

namespace perikit {

/// Values at the points of one interface whose gradients tell what an evaluation point sees of it: the positive and the negative
/// part of the distance, and something that is not zero at points of other materials.
enum class InterfaceValue { plus, minus, others };
inline constexpr int interface_values = 3;
double interface_value(const Interfaces& interfaces, std::size_t interface, std::size_t point, InterfaceValue what) noexcept;
/// Whether a gradient [-] of such values is more than rounding.
bool sees(int dimension, const double* gradient) noexcept;
/// From the gradients of the three values. False where the point is of one material, or where a laminate cannot stand for it.
bool find_laminate(int dimension, const double (&gradient)[interface_values][3], LaminatePoint& out) noexcept;
/// Its points: of an evaluation point with this owner.
void set_points(const Interfaces& interfaces, std::size_t interface, std::int32_t owner, LaminatePoint& out) noexcept;

class Laminates {
 public:
  /// numbers: those of the space lie below.
  Laminates(std::shared_ptr<const Interfaces> interfaces, std::size_t points, std::size_t numbers);

  const Interfaces& interfaces() const noexcept { return *interfaces_; }
  /// By group of eight points: whether they may own laminates.
  const std::vector<std::uint8_t>& near() const noexcept { return near_; }
  bool near(std::int32_t owner) const noexcept { return near_[static_cast<std::size_t>(owner) / padding]; }
  const LaminatePoint* at(std::int64_t number) const noexcept {
    const std::int32_t group = group_[static_cast<std::size_t>(number) / padding];
    if (group < 0) return nullptr;
    const LaminatePoint& point = point_[static_cast<std::size_t>(group) * padding + static_cast<std::size_t>(number) % padding];
    return point.share < 0 ? nullptr : &point;
  }
  void set(std::int64_t number, const LaminatePoint& point);
  void clear(std::int64_t number) noexcept;
  std::size_t count() const noexcept;
  std::size_t bytes() const noexcept;
  std::size_t kept_parallel = 0;  ///< evaluation points that see an interface and are no laminates

 private:
  std::shared_ptr<const Interfaces> interfaces_;
  std::vector<std::uint8_t> near_;
  std::vector<std::int32_t> group_;   ///< by number / padding; -1: none
  std::vector<LaminatePoint> point_;  ///< eight a group
};

}  // namespace perikit
