#include "body/interfaces.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "perikit/core/parallel.hpp"
#include "perikit/core/spectral.hpp"

namespace perikit {

namespace {

double dot(const Point& a, const Point& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point operator-(const Point& a, const Point& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// Places in boxes of one size, box by box.
class Boxes {
 public:
  Boxes(std::vector<Point> places, double size) : place_(std::move(places)), size_(size), order_(place_.size()) {
    if (place_.empty()) return;
    Point lower = place_.front(), upper = lower;
    for (const Point& x : place_)
      for (std::size_t c = 0; c < 3; ++c) {
        lower[c] = std::min(lower[c], x[c]);
        upper[c] = std::max(upper[c], x[c]);
      }
    lower_ = lower;
    for (std::size_t c = 0; c < 3; ++c) count_[c] = static_cast<std::int64_t>((upper[c] - lower[c]) / size) + 1;
    std::vector<std::int64_t> box(place_.size());
    parallel_for(box.size(), [&](std::size_t n) { box[n] = number(cell(place_[n])); });
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
      return std::pair(box[static_cast<std::size_t>(a)], a) < std::pair(box[static_cast<std::size_t>(b)], b);
    });
    key_.reserve(order_.size());
    for (const std::int32_t n : order_) key_.push_back(box[static_cast<std::size_t>(n)]);
  }

  const Point& place(std::size_t n) const noexcept { return place_[n]; }
  std::size_t size() const noexcept { return place_.size(); }

  /// By place: whether what lies in its box and those around it has different values. Different boxes are at least one size
  /// apart.
  std::vector<std::uint8_t> differing(std::span<const std::uint16_t> value) const {
    struct Range {
      std::int64_t box;
      std::uint16_t least, most;
    };
    std::vector<Range> boxes;
    std::vector<std::size_t> box_of(order_.size());
    for (std::size_t at = 0; at < order_.size(); ++at) {
      const std::uint16_t own = value[static_cast<std::size_t>(order_[at])];
      if (boxes.empty() || boxes.back().box != key_[at]) boxes.push_back({key_[at], own, own});
      boxes.back().least = std::min(boxes.back().least, own);
      boxes.back().most = std::max(boxes.back().most, own);
      box_of[at] = boxes.size() - 1;
    }
    std::vector<std::uint8_t> differ(boxes.size());
    parallel_for(boxes.size(), [&](std::size_t b) {
      const std::int64_t row = boxes[b].box / count_[0];
      const std::array<std::int64_t, 3> k{boxes[b].box % count_[0], row % count_[1], row / count_[1]};
      std::uint16_t least = boxes[b].least, most = boxes[b].most;
      over_rows(k, k, 1, [&](std::int64_t from, std::int64_t to) {
        for (auto at = std::ranges::lower_bound(boxes, from, {}, &Range::box); at != boxes.end() && at->box <= to; ++at) {
          least = std::min(least, at->least);
          most = std::max(most, at->most);
        }
      });
      differ[b] = least != most;
    });
    std::vector<std::uint8_t> of_place(order_.size());
    for (std::size_t at = 0; at < order_.size(); ++at) of_place[static_cast<std::size_t>(order_[at])] = differ[box_of[at]];
    return of_place;
  }

  /// visit(n, square of the distance) for all places no farther than `radius` from x, in an order that depends on the places
  /// alone.
  template <class Visit>
  void near(const Point& x, double radius, Visit&& visit) const {
    if (place_.empty()) return;
    over_rows(cell({x[0] - radius, x[1] - radius, x[2] - radius}), cell({x[0] + radius, x[1] + radius, x[2] + radius}), 0,
              [&](std::int64_t from, std::int64_t to) {
                for (auto at = std::lower_bound(key_.begin(), key_.end(), from); at != key_.end() && *at <= to; ++at) {
                  const auto n = static_cast<std::size_t>(order_[static_cast<std::size_t>(at - key_.begin())]);
                  const Point d = place_[n] - x;
                  if (const double square = dot(d, d); square <= radius * radius) visit(n, square);
                }
              });
  }

 private:
  /// visit(first, last) the boxes of each row that lies between two boxes, and `more` of them on every side: along the first axis
  /// they follow each other.
  template <class Visit>
  void over_rows(std::array<std::int64_t, 3> first, std::array<std::int64_t, 3> last, std::int64_t more, Visit&& visit) const {
    for (std::size_t c = 0; c < 3; ++c) {
      first[c] = std::max<std::int64_t>(0, first[c] - more);
      last[c] = std::min(count_[c] - 1, last[c] + more);
    }
    if (first[0] > last[0]) return;
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y) {
        const std::int64_t from = number({first[0], y, z});
        visit(from, from + last[0] - first[0]);
      }
  }

  std::int64_t index(double x, std::size_t c) const noexcept {
    return static_cast<std::int64_t>(std::floor((x - lower_[c]) / size_));
  }
  std::array<std::int64_t, 3> cell(const Point& x) const noexcept { return {index(x[0], 0), index(x[1], 1), index(x[2], 2)}; }
  std::int64_t number(const std::array<std::int64_t, 3>& k) const noexcept {
    return k[0] + count_[0] * (k[1] + count_[1] * k[2]);
  }

  std::vector<Point> place_;
  double size_;
  Point lower_{};
  std::array<std::int64_t, 3> count_{1, 1, 1};
  std::vector<std::int32_t> order_;
  std::vector<std::int64_t> key_;
};

/// The nearest point of another material.
struct Nearest {
  std::uint16_t material;
  double square;
  std::int32_t point;
};

/// A bond between nearest points of two materials, and the plane through the midpoints around it.
struct Crossing {
  std::uint16_t first, second;
  std::int32_t of_first, of_second;  ///< points
  double length;
  Point middle, along;  ///< along: a unit vector from the first material to the second
  Point normal, centre;
};

/// Distances that differ by no more than rounding are equal: of a lattice all nearest points count.
constexpr double equal_squares = 1 + 1e-9;

const Nearest* nearest_of(const std::vector<Nearest>& all, std::uint16_t material) noexcept {
  for (const Nearest& nearest : all)
    if (nearest.material == material) return &nearest;
  return nullptr;
}

/// Points are numbers in `boxes`.
std::vector<Crossing> find_crossings(const Body& body, const Boxes& boxes, std::span<const std::uint16_t> material) {
  const double horizon = body.horizon() * (1 + 1e-10);
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

/// 1 at x = 0, 0 from x = 1 on.
double falling(double x) noexcept {
  return x < 1 ? (1 - x * x) * (1 - x * x) : 0.0;
}

/// The direction in which the midpoints around one vary least, and their centre. Where they leave it open, along the bonds. The
/// other side of a thin layer is another surface: bonds that lead the other way.
void fit_plane(int dimension, const std::vector<Crossing>& all, const Boxes& middles, std::size_t n, Crossing& own) {
  constexpr double window = 3, core = 1.2;  // bonds long
  constexpr double undecided = 1e-12;       // weight of the directions of the bonds: below all variances but those that are zero
  const double radius = window * own.length;
  Point side{};
  middles.near(middles.place(n), core * own.length, [&](std::size_t m, double) {
    for (std::size_t a = 0; a < 3 && dot(all[m].along, own.along) > -0.5; ++a) side[a] += all[m].along[a];
  });
  double weight = 0;
  Point sum{}, along{};
  double moment[3][3] = {};
  middles.near(middles.place(n), radius, [&](std::size_t m, double square) {
    if (dot(all[m].along, side) < 0) return;
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
  const double length = std::copysign(std::sqrt(dot(own.normal, own.normal)), dot(own.normal, along));
  for (std::size_t a = 0; a < 3; ++a) {
    own.normal[a] /= length;
    own.centre[a] = own.middle[a] + sum[a] / weight;
  }
}

/// Distance of x from the planes of the crossings nearest to it, and the point of the nearest one on the side that x does not lie
/// on.
struct Distance {
  double value = 0;
  std::int32_t counterpart = -1;
};

Distance distance_of(const Point& x, bool in_first, std::span<const Crossing> all, const Boxes& middles, double reach) {
  double least = INFINITY;
  std::size_t nearest = 0;
  middles.near(x, reach, [&](std::size_t m, double square) {
    if (std::pair(square, m) < std::pair(least, nearest)) {
      least = square;
      nearest = m;
    }
  });
  if (!std::isfinite(least)) return {};
  // Blended over one more bond, so that no side of a surface is preferred.
  const double from = std::sqrt(least), length = all[nearest].length;
  double weight = 0, sum = 0;
  middles.near(x, from + length, [&](std::size_t m, double square) {
    if (dot(all[m].normal, all[nearest].normal) <= 0) return;
    const double w = falling(std::max(0.0, std::sqrt(square) - from) / length);
    weight += w;
    sum += w * dot(x - all[m].centre, all[m].normal);
  });
  const double value = sum / weight;
  // A point lies on the side of its material.
  return {in_first ? std::min(value, 0.0) : std::max(value, 0.0), in_first ? all[nearest].of_second : all[nearest].of_first};
}

}  // namespace

std::ptrdiff_t Interface::find(std::int32_t p) const noexcept {
  const auto at = std::lower_bound(point.begin(), point.end(), p);
  return at != point.end() && *at == p ? at - point.begin() : -1;
}

Interfaces find_interfaces(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> sources,
                           double reach) {
  Interfaces found;
  if (std::ranges::all_of(material, [&](std::uint16_t m) { return m == material.front(); })) return found;
  // By input number: an order that no layout of the points changes.
  std::vector<Point> places;
  for (const std::int32_t p : body.internal()) places.push_back(body.position(static_cast<std::size_t>(p)));
  const std::size_t real = places.size() - sources.size();
  const auto source = [&](std::size_t n) { return n < real ? n : static_cast<std::size_t>(sources[n - real]); };
  const Boxes boxes(std::move(places), body.horizon() * (1 + 1e-9));
  std::vector<Crossing> crossings = find_crossings(body, boxes, material);
  found.length = body.horizon();
  found.material.assign(body.stride(), 0);
  found.source.assign(body.stride(), -1);
  const auto internal = body.internal();
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    found.material[static_cast<std::size_t>(internal[n])] = material[n];
    found.source[static_cast<std::size_t>(internal[n])] = internal[source(n)];
  }
  for (auto begin = crossings.begin(); begin != crossings.end();) {
    const auto end = std::find_if(begin, crossings.end(),
                                  [&](const Crossing& c) { return c.first != begin->first || c.second != begin->second; });
    std::vector<Crossing> own(begin, end);
    std::vector<Point> middle;
    for (const Crossing& c : own) middle.push_back(c.middle);
    const Boxes middles(std::move(middle), reach);
    parallel_for(own.size(), [&](std::size_t n) { fit_plane(body.dimension(), own, middles, n, own[n]); });
    std::vector<Distance> distance(boxes.size());
    // What lies beyond a plane of symmetry is the image of what lies before it.
    parallel_for(real, [&](std::size_t n) {
      if (material[n] == own.front().first || material[n] == own.front().second)
        distance[n] = distance_of(boxes.place(n), material[n] == own.front().first, own, middles, reach);
    });
    std::vector<std::int32_t> near;
    for (std::size_t n = real; n < boxes.size(); ++n) distance[n] = distance[source(n)];
    for (std::size_t n = 0; n < boxes.size(); ++n)
      if (distance[n].counterpart >= 0) near.push_back(static_cast<std::int32_t>(n));
    std::ranges::sort(near, {}, [&](std::int32_t n) { return internal[static_cast<std::size_t>(n)]; });
    Interface& interface = found.all.emplace_back();
    interface.first = own.front().first;
    interface.second = own.front().second;
    for (const std::int32_t n : near) {
      const Distance& of = distance[static_cast<std::size_t>(n)];
      interface.point.push_back(internal[static_cast<std::size_t>(n)]);
      interface.distance.push_back(of.value);
      interface.counterpart.push_back(internal[source(static_cast<std::size_t>(of.counterpart))]);
    }
    begin = end;
  }
  return found;
}

Interfaces interfaces_of_part(const Body& part, const Body& whole, const Interfaces& known) {
  Interfaces found;
  found.notes = known.notes;
  if (known.empty()) return found;
  found.length = known.length;
  found.material.assign(part.stride(), 0);
  found.source.assign(part.stride(), -1);
  std::vector<std::int32_t> here(whole.stride(), -1);  // by internal index of the whole body
  for (const std::int32_t index : part.internal()) {
    const auto p = static_cast<std::size_t>(index);
    const auto original = static_cast<std::size_t>(whole.internal()[static_cast<std::size_t>(part.number(p))]);
    here[original] = index;
    found.material[p] = known.material[original];
  }
  for (const std::int32_t index : part.internal()) {
    const auto original = static_cast<std::size_t>(whole.internal()[static_cast<std::size_t>(part.number(static_cast<std::size_t>(index)))]);
    found.source[static_cast<std::size_t>(index)] = here[static_cast<std::size_t>(known.source[original])];
  }
  for (const Interface& from : known.all) {
    std::vector<std::pair<std::int32_t, std::size_t>> points;
    for (std::size_t at = 0; at < from.point.size(); ++at)
      if (const std::int32_t p = here[static_cast<std::size_t>(from.point[at])]; p >= 0) points.push_back({p, at});
    if (points.empty()) continue;
    std::ranges::sort(points);
    Interface& to = found.all.emplace_back();
    to.first = from.first;
    to.second = from.second;
    for (const auto& [p, at] : points) {
      to.point.push_back(p);
      to.distance.push_back(from.distance[at]);
      // -1 where it lies on another rank: there constants are those of the material.
      to.counterpart.push_back(here[static_cast<std::size_t>(from.counterpart[at])]);
    }
  }
  return found;
}

}  // namespace perikit
