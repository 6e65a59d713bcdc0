#pragma once
/// Forces of a traction that varies over a surface, with the resultant and the first moments of the traction.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/problem/space_time_function.hpp"

namespace perikit {

/// Places at which a traction is evaluated, in groups. The traction of a point is the mean over its group.
struct SurfaceSamples {
  std::vector<Point> place;
  std::vector<double> weight;             ///< of the integral over the surface [m^2]; 0: no part of it, or another rank's
  std::vector<std::size_t> first{0};      ///< first place of each group, and the end
  std::vector<std::int32_t> group;        ///< of each point of the load

  /// Adds the places of a group that has so many already.
  std::int32_t end_group() {
    first.push_back(place.size());
    return static_cast<std::int32_t>(first.size()) - 2;
  }
};

/// Adds a group: the Gauss points, two along each tangent, of a square (2D: a length times the thickness) across `axis` around
/// `centre`. share: of the integral that the group has [m^2]. Returns its number.
std::int32_t add_cell(int dimension, int axis, const Point& centre, double side, double share, SurfaceSamples& samples);

/// The shares s_k of points in a surface hold a uniform traction in equilibrium, but s_k t(x_k) of a traction that varies has another
/// moment than the traction: shares near edges are smaller and larger than their cells. The forces are
///   f_k = s_k t_k + |s_k| (c_0 + c . (X_k - X_0)),
/// the least change, in the sense of sum f^2/|s|, for which sum f_k and sum f_k X_k are the integrals of t and t x over the surface
/// (by the samples): the virtual work of every affine motion is exact. A uniform traction keeps s_k t, whatever its moment.
/// Moments along directions in which the points do not spread stay as they are.
class SurfaceRule {
 public:
  /// points, share: of the load, images among them; `body` must outlive it. Of a part of a body all ranks must call it, and `forces`.
  SurfaceRule(const Body& body, std::vector<std::int32_t> points, std::vector<double> share, SurfaceSamples samples);

  /// Of the load's points, for a value [per unit of share] at time t [N].
  std::vector<double> forces(const SpaceTimeFunction& value, double t) const;

 private:
  static constexpr std::size_t size = 4;  ///< of the basis 1, x, y, z
  using Moments = std::array<double, size>;
  Moments basis(const Point& x) const;
  Moments solve(Moments moments) const;

  const Body* body_;
  std::vector<std::int32_t> points_;
  std::vector<double> share_;
  SurfaceSamples samples_;
  std::vector<bool> used_;                ///< by group: whether a point with a share has it, or the integral
  Point origin_{};
  std::array<Moments, size> factors_{};   ///< of the Gram matrix, L D L^T; D = 0: left out
  double area_ = 0;                       ///< sum of |weight| [m^2]
  Moments uniform_{};                     ///< what the moments of a uniform unit traction lack
};

}  // namespace perikit
