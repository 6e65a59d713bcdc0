#include "cloud_balance/points_with_full_neighbourhood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "body/voronoi/voronoi.hpp"
#include "core/symmetric_matrix.hpp"
#include "families/cloud/cloud_families.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

struct Box {
  Point lower{}, upper{};
  void add(const Point& x) {
    for (std::size_t c = 0; c < 3; ++c) {
      lower[c] = std::min(lower[c], x[c]);
      upper[c] = std::max(upper[c], x[c]);
    }
  }
};

Box box_of(const Body& body, std::span<const std::int32_t> points) {
  constexpr double none = std::numeric_limits<double>::infinity();
  Box box{{none, none, none}, {-none, -none, -none}};
  for (const std::int32_t p : points) box.add(body.position(static_cast<std::size_t>(p)));
  return box;
}

/// Of all ranks.
Box whole_box_of(const Body& body, std::span<const std::int32_t> points) {
  Box box = box_of(body, points);
  for (std::size_t c = 0; c < 3; ++c) {
    box.lower[c] = -communicator().largest(-box.lower[c]);
    box.upper[c] = communicator().largest(box.upper[c]);
  }
  return box;
}

/// Where points are, each place once: images of points on a mirror lie on their sources.
struct Places {
  std::vector<Point> position;
  std::vector<double> volume;   ///< of all points there
  std::vector<std::size_t> of;  ///< by point
};

Places places_of(const Body& body) {
  Places places;
  places.of.resize(body.points());
  std::vector<std::size_t> order(body.points());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (std::ranges::none_of(order, [&](std::size_t p) { return body.image(p); })) {
    for (const std::size_t p : order) {
      places.position.push_back(body.position(p));
      places.volume.push_back(body.volume(p));
    }
    places.of = std::move(order);
    return places;
  }
  std::ranges::sort(order, {}, [&](std::size_t p) { return std::pair(body.position(p), p); });
  for (const std::size_t p : order) {
    const Point x = body.position(p);
    if (places.position.empty() || places.position.back() != x) {
      places.position.push_back(x);
      places.volume.push_back(0);
    }
    places.volume.back() += body.volume(p);
    places.of[p] = places.position.size() - 1;
  }
  return places;
}

/// By point: 1 where its cell is open, 2 where its bonds are cut as well or its family is too poor; of images what their sources
/// are, of points of other ranks what these say.
Field open_cells(const Families& families, const std::function<void(FieldView)>& copy_from_sources) {
  const Body& body = families.body();
  Box box = box_of(body, body.internal());
  for (std::size_t c = 0; c < 3; ++c) {
    box.lower[c] -= 2 * body.horizon();
    box.upper[c] += 2 * body.horizon();
  }
  const Places places = places_of(body);
  const VoronoiCells cells = voronoi_cells(places.position, body.dimension(), box.lower, box.upper);
  Field open = body.make_field(1);
  for (const std::int32_t p : body.owned()) {
    const auto at = static_cast<std::size_t>(p), cell = places.of[at];
    const bool torn = families.damage(at) > 0 || !std::isfinite(families.condition(at));
    open.data()[p] = torn ? 2 : cells.reach[cell] > 1.5 * spacing_of(body, places.volume[cell]) ? 1 : 0;
  }
  if (copy_from_sources) copy_from_sources(open);
  return open;
}

/// n n^T of the surface at open cells, summed over the sides that a cell belongs to: those of the box around the body that are
/// near, else the one away from its family.
class Normals {
 public:
  Normals(const CloudFamilies& families, const std::function<void(FieldView)>& copy_from_sources)
      : body_(families.body()), sides_(body_.make_field(3)), away_(sides_) {
    const Box own = whole_box_of(body_, body_.owned()), all = whole_box_of(body_, body_.internal());
    for (const std::int32_t p : body_.owned()) {
      const auto at = static_cast<std::size_t>(p);
      const Point x = body_.position(at);
      const double h = spacing_of(body_, at);
      for (int c = 0; c < body_.dimension(); ++c) {
        const auto axis = static_cast<std::size_t>(c);
        // Sides with images beyond are none.
        const bool below = x[axis] < own.lower[axis] + 0.75 * h && all.lower[axis] == own.lower[axis];
        const bool above = x[axis] > own.upper[axis] - 0.75 * h && all.upper[axis] == own.upper[axis];
        sides_.component(c)[p] = below || above;
      }
      for (const std::int32_t j : families.neighbours(at)) {
        const Point far = body_.position(static_cast<std::size_t>(j));
        for (int c = 0; c < body_.dimension(); ++c) {
          const auto axis = static_cast<std::size_t>(c);
          away_.component(c)[p] += body_.volume(static_cast<std::size_t>(j)) * (far[axis] - x[axis]);
        }
      }
    }
    if (!copy_from_sources) return;
    copy_from_sources(sides_);
    copy_from_sources(away_);
  }

  /// Adds those of point p, n (x) n each, to a d x d matrix.
  void add(std::size_t p, std::array<double, 9>& sum) const {
    const auto d = static_cast<std::size_t>(body_.dimension());
    bool any = false;
    for (std::size_t c = 0; c < d; ++c) {
      const double side = sides_.component(static_cast<int>(c))[p];
      sum[c * d + c] += side;
      any |= side != 0;
    }
    if (any) return;
    double moment[3] = {}, square = 0;
    for (std::size_t c = 0; c < d; ++c) {
      moment[c] = away_.component(static_cast<int>(c))[p];
      square += moment[c] * moment[c];
    }
    for (std::size_t a = 0; a < d && square > 0; ++a)
      for (std::size_t b = 0; b < d; ++b) sum[a * d + b] += moment[a] * moment[b] / square;
  }

 private:
  const Body& body_;
  Field sides_;  ///< by component: whether the point is near a side of the box across that axis
  Field away_;   ///< from the surface: first moment of the family's volumes
};

}  // namespace

double spacing_of(const Body& body, std::size_t p) {
  return spacing_of(body, body.volume(p));
}
double spacing_of(const Body& body, double volume) {
  return std::pow(volume / body.section(), 1.0 / body.dimension());
}

ClosedComponents::ClosedComponents(ClosedPoints closed, const Body& body)
    : closed_(std::move(closed)), body_(body), whole_(body.stride(), 0) {
  for (const std::int32_t p : closed_.whole) whole_[static_cast<std::size_t>(p)] = 1;
}

void ClosedComponents::project(FieldView y) const {
  const auto d = static_cast<std::size_t>(body_.dimension());
  std::vector<std::array<double, 3>> kept;
  for (const auto& [p, along] : closed_.at_surfaces) {
    std::array<double, 3>& value = kept.emplace_back();
    for (std::size_t a = 0; a < d; ++a)
      for (std::size_t c = 0; c < d; ++c) value[a] += along[3 * a + c] * y.component(static_cast<int>(c))[p];
  }
  for (std::size_t c = 0; c < d; ++c)
    for (std::size_t p = 0; p < body_.stride(); ++p)
      if (!whole_[p]) y.component(static_cast<int>(c))[p] = 0;
  for (std::size_t k = 0; k < kept.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) y.component(static_cast<int>(c))[closed_.at_surfaces[k].point] = kept[k][c];
}

double ClosedComponents::magnitude(ConstFieldView y, std::size_t p) const {
  double square = 0;
  for (int c = 0; c < body_.dimension(); ++c) square += y.component(c)[p] * y.component(c)[p];
  return std::sqrt(square) * spacing_of(body_, p) / body_.volume(p);
}

double ClosedComponents::largest(ConstFieldView y, Point* where) const {
  double most = 0;
  std::size_t worst = 0;
  for (const std::int32_t p : body_.owned()) {
    const double value = magnitude(y, static_cast<std::size_t>(p));
    if (value <= most) continue;
    most = value;
    worst = static_cast<std::size_t>(p);
  }
  const double of_all = communicator().largest(most);
  if (where)
    for (std::size_t c = 0; c < 3; ++c)
      (*where)[c] = communicator().largest(most == of_all ? body_.position(worst)[c] : -std::numeric_limits<double>::infinity());
  return of_all;
}

std::size_t ClosedComponents::let_go(ConstFieldView y, double above) {
  const auto blamed = [&](std::int32_t p) { return magnitude(y, static_cast<std::size_t>(p)) > above; };
  std::int64_t gone = static_cast<std::int64_t>(
      std::erase_if(closed_.at_surfaces, [&](const ClosedPoints::AtSurface& surface) { return blamed(surface.point); }));
  communicator().sum({&gone, 1});
  if (gone > 0) return static_cast<std::size_t>(gone);
  for (const std::int32_t p : closed_.whole)
    if (blamed(p)) whole_[static_cast<std::size_t>(p)] = 0;
  gone = static_cast<std::int64_t>(std::erase_if(closed_.whole, [&](std::int32_t p) { return blamed(p); }));
  communicator().sum({&gone, 1});
  return static_cast<std::size_t>(gone);
}

ClosedPoints find_closed_points(const Families& families, const std::function<void(FieldView)>& copy_from_sources) {
  const Body& body = families.body();
  const CloudFamilies& cloud = *families.cloud();
  const Field open = open_cells(families, copy_from_sources);
  const Normals normals(cloud, copy_from_sources);
  ClosedPoints closed;
  for (const std::int32_t p : body.owned()) {
    const auto at = static_cast<std::size_t>(p);
    std::array<double, 9> sides{};
    double worst = open.data()[p];
    if (worst == 1) normals.add(at, sides);
    for (const std::int32_t j : cloud.neighbours(at)) {
      if (open.data()[j] == 0) continue;
      worst = std::max(worst, open.data()[j]);
      normals.add(static_cast<std::size_t>(j), sides);
    }
    if (worst == 0) closed.whole.push_back(p);
    if (worst != 1 || body.dimension() == 1) continue;
    // Directions that hardly any of the normals has; a surface with a radius of three horizons has less than this across its mean
    // normal.
    constexpr double least = 0.02;
    const int d = body.dimension();
    const SymmetricEigen axes(d, sides.data());
    double trace = 0;
    for (int k = 0; k < d; ++k) trace += axes.value(k);
    ClosedPoints::AtSurface along{p, {}};
    bool any = false;
    for (int k = 0; k < d; ++k) {
      if (axes.value(k) > least * trace) continue;
      any = true;
      for (int a = 0; a < d; ++a)
        for (int b = 0; b < d; ++b)
          along.along[static_cast<std::size_t>(3 * a + b)] += axes.vector(a, k) * axes.vector(b, k);
    }
    if (any) closed.at_surfaces.push_back(along);
  }
  return closed;
}

}  // namespace perikit
