#include "body/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "body/family_limit.hpp"
#include "perikit/core/spectral.hpp"

namespace perikit {

namespace {

/// The nearest point of another material.
struct Nearest {
  std::uint16_t material;
  double square;
  std::int32_t point;
};

/// Distances that differ by no more than rounding are equal: of a lattice all nearest points count.
constexpr double equal_squares = 1 + 1e-9;

const Nearest* nearest_of(const std::vector<Nearest>& all, std::uint16_t material) noexcept {
  for (const Nearest& nearest : all)
    if (nearest.material == material) return &nearest;
  return nullptr;
}

}  // namespace

std::vector<Crossing> find_crossings(double longest, const Boxes& boxes, std::span<const std::uint16_t> material) {
  const double horizon = family_limit(longest);
  const std::vector<std::uint8_t> differing = boxes.differing(material);
  std::vector<std::vector<Nearest>> nearest(boxes.size());
  parallel_for(boxes.size(), [&](std::size_t n) {
    if (!differing[n]) return;
    const Point& x = boxes.place(n);
    boxes.near(x, horizon, [&](std::size_t m, double square) {
      if (material[m] == material[n]) return;
      const auto known = std::ranges::find(nearest[n], material[m], &Nearest::material);
      const Nearest found{material[m], square, static_cast<std::int32_t>(m)};
      if (known == nearest[n].end())
        nearest[n].push_back(found);
      else if (std::pair(square, found.point) < std::pair(known->square, known->point))
        *known = found;
    });
  });
  std::vector<std::vector<Crossing>> of_point(boxes.size());
  parallel_for(boxes.size(), [&](std::size_t n) {
    const Point& x = boxes.place(n);
    for (const Nearest& other : nearest[n]) {
      if (other.material < material[n]) continue;
      boxes.near(x, std::sqrt(other.square * equal_squares), [&](std::size_t m, double square) {
        if (material[m] != other.material) return;
        const Nearest* const back = nearest_of(nearest[m], material[n]);
        if (!back || square > back->square * equal_squares) return;
        Crossing c{
            material[n], material[m], static_cast<std::int32_t>(n), static_cast<std::int32_t>(m), std::sqrt(square), {}, {},
            {},          {}};
        for (std::size_t a = 0; a < 3; ++a) {
          c.middle[a] = 0.5 * (x[a] + boxes.place(m)[a]);
          c.along[a] = (boxes.place(m)[a] - x[a]) / c.length;
        }
        of_point[n].push_back(c);
      });
    }
  });
  std::vector<Crossing> all;
  for (const auto& crossings : of_point) all.insert(all.end(), crossings.begin(), crossings.end());
  std::ranges::sort(all, {}, [](const Crossing& c) { return std::tuple(c.first, c.second, c.of_first, c.of_second); });
  return all;
}

namespace {

/// 1 at x = 0, 0 from x = 1 on.
double falling(double x) noexcept {
  return x < 1 ? (1 - x * x) * (1 - x * x) : 0.0;
}

/// The direction in which the midpoints around one vary least, and their centre. Where they leave it open, along the bonds. The
/// other side of a thin layer is another surface: bonds that lead the other way.
void fit_plane(int dimension, const std::vector<Crossing>& all, const Boxes& middles, std::size_t n, Crossing& own) {
  constexpr double window = 3, core = 1.2;  // bonds long
  constexpr double undecided = 1e-12;       // weight of the directions of the bonds: below all variances but those that are zero
  constexpr double across = -1e-6;          // of bonds at right angles to the side, which count, whatever rounding says
  const double radius = window * own.length;
  Point side{};
  middles.near(middles.place(n), core * own.length, [&](std::size_t m, double) {
    for (std::size_t a = 0; a < 3 && dot(all[m].along, own.along) > -0.5; ++a) side[a] += all[m].along[a];
  });
  double weight = 0;
  Point sum{}, along{};
  double moment[3][3] = {};
  middles.near(middles.place(n), radius, [&](std::size_t m, double square) {
    if (dot(all[m].along, side) < across) return;
    const double w = falling(std::sqrt(square) / radius);
    const Point x = middles.place(m) - own.middle;
    weight += w;
    for (std::size_t a = 0; a < 3; ++a) {
      sum[a] += w * x[a];
      along[a] += w * all[m].along[a];
      for (std::size_t b = 0; b < 3; ++b) moment[a][b] += w * x[a] * x[b];
    }
  });
  Tensor<double, Solid> variance;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const auto i = static_cast<std::size_t>(a), k = static_cast<std::size_t>(b);
      const bool outside = a >= dimension || b >= dimension;
      variance(a, b) = outside ? (a == b ? 1.0 : 0.0)
                               : (moment[i][k] / weight - sum[i] * sum[k] / (weight * weight)) / (radius * radius) -
                                     undecided * along[i] * along[k] / (weight * weight);
    }
  const auto modes = spectral(variance);
  int least = 0;
  for (int k = 1; k < 3; ++k)
    if (modes.values[k] < modes.values[least]) least = k;
  for (int a = 0; a < 3; ++a) own.normal[static_cast<std::size_t>(a)] = a < dimension ? modes.vectors(a, least) : 0.0;
  // Few midpoints may vary least along the surface, of a grain of two points or so: nothing would say which way that direction points.
  constexpr double steepest = 0.5;   // cosine between a normal and the bonds
  if (std::abs(dot(own.normal, along)) < steepest * std::sqrt(dot(own.normal, own.normal) * dot(along, along))) own.normal = along;
  const double length = std::copysign(std::sqrt(dot(own.normal, own.normal)), dot(own.normal, along));
  for (std::size_t a = 0; a < 3; ++a) {
    own.normal[a] /= length;
    own.centre[a] = own.middle[a] + sum[a] / weight;
  }
}

/// Of one point.
class DistanceOf {
 public:
  DistanceOf(const Point& x, bool in_first, std::span<const Crossing> all, const Boxes& middles)
      : x_(x), in_first_(in_first), all_(all), middles_(middles) {}

  /// Calls visit(m, square) for the midpoints up to `reach` away that the point can see. Those whose surface it is behind, by more than a bond, lie
  /// beyond another material, as in stacks of three.
  template <class Visit>
  void near(double reach, const Visit& visit) const {
    middles_.near(x_, reach, [&](std::size_t m, double square) {
      if (!((in_first_ ? height(m) : -height(m)) > all_[m].length)) visit(m, square);
    });
  }

  /// Blended over one more bond beyond the nearest midpoint, so that no side of a surface is preferred; sides at right angles to
  /// it are other surfaces.
  double blended(std::size_t nearest, double from) const {
    constexpr double across = 1e-6;  // cosine
    double weight = 0, sum = 0;
    near(from + all_[nearest].length, [&](std::size_t m, double square) {
      if (dot(all_[m].normal, all_[nearest].normal) <= across) return;
      const double w = falling(std::max(0.0, std::sqrt(square) - from) / all_[nearest].length);
      weight += w;
      sum += w * height(m);
    });
    return sum / weight;
  }

 private:
  double height(std::size_t m) const { return dot(x_ - all_[m].centre, all_[m].normal); }

  const Point& x_;
  bool in_first_;
  std::span<const Crossing> all_;
  const Boxes& middles_;
};

Distance distance_of(const Point& x, bool in_first, std::span<const Crossing> all, const Boxes& middles, double reach) {
  const DistanceOf point(x, in_first, all, middles);
  double least = INFINITY;
  point.near(reach, [&](std::size_t, double square) { least = std::min(least, square); });
  if (!std::isfinite(least)) return {};
  // Of several midpoints that are equally near, in corners and in the middle of layers, each has its say.
  const double from = std::sqrt(least);
  double sum = 0;
  int count = 0;
  std::size_t first = all.size();
  point.near(std::min(reach, from * (1 + 1e-6)), [&](std::size_t m, double) {
    sum += point.blended(m, from);
    ++count;
    first = std::min(first, m);
  });
  // A point lies on the side of its material.
  const double value = sum / count;
  return {in_first ? std::min(value, 0.0) : std::max(value, 0.0), in_first ? all[first].of_second : all[first].of_first};
}

std::vector<Point> middles_of(const std::vector<Crossing>& crossings) {
  std::vector<Point> middles;
  for (const Crossing& c : crossings) middles.push_back(c.middle);
  return middles;
}

}  // namespace

Point lowest_middle(std::span<const Crossing> crossings) {
  Point lower = crossings.front().middle;
  for (const Crossing& c : crossings)
    for (std::size_t a = 0; a < 3; ++a) lower[a] = std::min(lower[a], c.middle[a]);
  return lower;
}

MaterialSurface::MaterialSurface(const Body& body, std::vector<Crossing> crossings, const Point& lower, double reach)
    : crossings_(std::move(crossings)), middles_(middles_of(crossings_), reach, &lower), reach_(reach) {
  parallel_for(crossings_.size(), [&](std::size_t n) { fit_plane(body.dimension(), crossings_, middles_, n, crossings_[n]); });
}

Distance MaterialSurface::distance(const Point& x, std::uint16_t material) const {
  if (material != first() && material != second()) return {};
  return distance_of(x, material == first(), crossings_, middles_, reach_);
}

}  // namespace perikit
