#include "body/images/curved_cracks.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace perikit {

namespace {

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

Point between(const Point& a, const Point& b, double s) {
  return {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])};
}

/// The part of a piece that lies in front of the mirror; empty: none.
std::vector<Point> in_front(const CurvedMirror& mirror, const std::vector<Point>& vertices) {
  const bool closed = vertices.size() > 2;
  std::vector<Point> kept;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const bool front = mirror.level(vertices[i]) <= 0;
    if (front) kept.push_back(vertices[i]);
    if (!closed && i + 1 == vertices.size()) break;
    const Point& next = vertices[(i + 1) % vertices.size()];
    if (front == (mirror.level(next) <= 0)) continue;
    double low = 0, high = 1;  // the mirror lies between them
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      ((mirror.level(between(vertices[i], next, middle)) <= 0) == front ? low : high) = middle;
    }
    kept.push_back(between(vertices[i], next, front ? low : high));
  }
  return kept.size() >= std::min<std::size_t>(vertices.size(), 3) ? kept : std::vector<Point>();
}

void add_image(const CurvedMirror& mirror, const std::vector<Point>& piece, std::vector<Crack>& cracks) {
  std::vector<Point> image;
  for (const Point& x : in_front(mirror, piece)) {
    const std::optional<Point> at = mirror.image(x);
    if (!at) return;
    image.push_back(*at);
  }
  const double least = 1e-9 * mirror.piece;
  if (image.size() == 2 && distance(image[0], image[1]) > least) cracks.emplace_back(image);
  // The images of four vertices need not lie in a plane.
  for (std::size_t k = 2; k < image.size(); ++k)
    if (distance(image[0], image[k - 1]) > least && distance(image[k - 1], image[k]) > least && distance(image[0], image[k]) > least)
      cracks.emplace_back(std::vector<Point>{image[0], image[k - 1], image[k]});
}

/// Halves the longest edge of a triangle until no edge is longer than a piece.
void each_piece(const CurvedMirror& mirror, const std::array<Point, 3>& triangle, std::vector<Crack>& cracks) {
  std::size_t longest = 0;
  double length = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (const double edge = distance(triangle[k], triangle[(k + 1) % 3]); edge > length) length = edge, longest = k;
  if (length <= mirror.piece) return add_image(mirror, {triangle.begin(), triangle.end()}, cracks);
  const Point &a = triangle[longest], &b = triangle[(longest + 1) % 3], &c = triangle[(longest + 2) % 3], middle = between(a, b, 0.5);
  each_piece(mirror, {a, middle, c}, cracks);
  each_piece(mirror, {middle, b, c}, cracks);
}

}  // namespace

void mirror_cracks(const CurvedMirror& mirror, std::vector<Crack>& cracks) {
  const std::size_t n = cracks.size();
  for (std::size_t k = 0; k < n; ++k) {
    const std::vector<Point> vertices = cracks[k].vertices();
    if (vertices.size() == 2) {
      const auto pieces = static_cast<int>(std::ceil(distance(vertices[0], vertices[1]) / mirror.piece));
      for (int i = 0; i < pieces; ++i)
        add_image(mirror, {between(vertices[0], vertices[1], static_cast<double>(i) / pieces), between(vertices[0], vertices[1], (i + 1.0) / pieces)}, cracks);
      continue;
    }
    for (std::size_t i = 2; i < vertices.size(); ++i) each_piece(mirror, {vertices[0], vertices[i - 1], vertices[i]}, cracks);
  }
}

}  // namespace perikit
