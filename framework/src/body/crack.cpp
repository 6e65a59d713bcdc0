#include <algorithm>
#include <cmath>

#include "body/points/point_arithmetic.hpp"

namespace perikit {

namespace {

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// Slack for points on the crack and for bonds that pass exactly through an end or an edge, relative to the crack's size.
constexpr double slack = 1e-9;

/// x lies in the plane polygon: the number of edges that a ray crosses is odd, or x lies on an edge.
bool inside_polygon(const std::vector<Point>& v, const Point& normal, const Point& x) {
  const auto drop = static_cast<std::size_t>(std::max_element(normal.begin(), normal.end(), [](double a, double b) {
                                               return std::abs(a) < std::abs(b);
                                             }) - normal.begin());
  const std::size_t a = (drop + 1) % 3, b = (drop + 2) % 3;
  bool inside = false;
  for (std::size_t i = 0, j = v.size() - 1; i < v.size(); j = i++) {
    const double ea = v[i][a] - v[j][a], eb = v[i][b] - v[j][b], pa = x[a] - v[j][a], pb = x[b] - v[j][b];
    const double length2 = ea * ea + eb * eb;
    const double along = length2 > 0 ? std::clamp((pa * ea + pb * eb) / length2, 0.0, 1.0) : 0.0;
    if (std::hypot(pa - along * ea, pb - along * eb) <= slack * std::sqrt(length2)) return true;
    if ((v[i][b] > x[b]) != (v[j][b] > x[b]) && x[a] < v[j][a] + (x[b] - v[j][b]) * ea / eb) inside = !inside;
  }
  return inside;
}

}  // namespace

Crack::Crack(std::vector<Point> vertices) : vertices_(std::move(vertices)) {
  lower_ = upper_ = vertices_.front();
  for (const Point& v : vertices_) {
    for (std::size_t c = 0; c < 3; ++c) {
      lower_[c] = std::min(lower_[c], v[c]);
      upper_[c] = std::max(upper_[c], v[c]);
    }
  }
  if (vertices_.size() == 2) {
    const Point t = vertices_[1] - vertices_[0];
    normal_ = {-t[1], t[0], 0.0};
  } else {
    for (std::size_t i = 2; i < vertices_.size(); ++i) {
      const Point n = cross(vertices_[i - 1] - vertices_[0], vertices_[i] - vertices_[0]);
      for (std::size_t c = 0; c < 3; ++c) normal_[c] += n[c];
    }
  }
}

bool Crack::near(const Point& x, double length) const noexcept {
  const std::size_t d = vertices_.size() == 2 ? 2 : 3;
  for (std::size_t c = 0; c < d; ++c) {
    if (x[c] < lower_[c] - length || x[c] > upper_[c] + length) return false;
  }
  return true;
}

bool Crack::cuts(const Point& a, const Point& b) const noexcept {
  const double side_a = dot(a - vertices_[0], normal_), side_b = dot(b - vertices_[0], normal_);
  // The normal is as long as the crack, or as large as its area. Points on the crack count to one side, all to the same.
  const double square = dot(normal_, normal_), size = vertices_.size() > 2 ? std::sqrt(std::sqrt(square)) : std::sqrt(square);
  const double on_crack = -slack * size * std::sqrt(square);
  if ((side_a >= on_crack) == (side_b >= on_crack)) return false;
  const double s = side_a / (side_a - side_b);
  const Point x{a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])};
  if (vertices_.size() > 2) return inside_polygon(vertices_, normal_, x);
  const Point t = vertices_[1] - vertices_[0];
  const double along = (t[0] * (x[0] - vertices_[0][0]) + t[1] * (x[1] - vertices_[0][1])) / (t[0] * t[0] + t[1] * t[1]);
  return along >= -slack && along <= 1 + slack;
}

}  // namespace perikit
