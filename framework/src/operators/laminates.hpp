#pragma once
/// Which evaluation points of a space are laminates, by their stable numbers. Found by passes of the space over the distances of
/// points from interfaces in place of displacements, so that what is found belongs to the stencils as they are.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "body/interfaces.hpp"
#include "core/group_marks.hpp"
#include "operators/laminate.hpp"

namespace perikit {

struct BatchScratch;

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

/// By the stencil of an evaluation point: gradient(value, g) writes the gradient of value(p), p points of the body.
template <class Gradient>
bool laminate_by_stencil(int dimension, const Interfaces& interfaces, std::int32_t owner, Gradient&& gradient,
                         LaminatePoint& out) {
  for (std::size_t k = 0; k < interfaces.all.size(); ++k) {
    if (interfaces.all[k].find(owner) < 0) continue;
    double g[interface_values][3] = {};
    bool seen = true;
    for (int v = 0; v < interface_values && seen; ++v) {
      const auto what = static_cast<InterfaceValue>(v);
      gradient([&](std::size_t p) { return interface_value(interfaces, k, p, what); }, g[v]);
      seen = what == InterfaceValue::others || sees(dimension, g[v]);
    }
    if (!seen || !find_laminate(dimension, g, out)) continue;
    set_points(interfaces, k, owner, out);
    return true;
  }
  return false;
}

/// Gradients that passes of a space leave behind, by number.
class LaminateFinder {
 public:
  struct Found {
    std::int64_t number;
    std::int32_t owner, far;    ///< far: of bonds; else -1
    std::int64_t other_number;  ///< of the state that the other end has for itself; -1: none
    double gradient[3][3];      ///< by component of the displacement
  };

  /// once_for_both: bonds have the number of the end with the smaller index. keep: of these components all gradients must be
  /// there. with_weightless: evaluation points that have no weight at present are found, too.
  LaminateFinder(int dimension, bool once_for_both, int keep, bool with_weightless = false);
  /// H: before the selective map.
  void add(int n, const double* H, const BatchScratch& s);
  /// In ascending order of numbers.
  std::vector<Found> take();

 private:
  int dimension_, keep_;
  bool once_, with_weightless_;
  std::vector<std::vector<Found>> of_thread_;
};

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
