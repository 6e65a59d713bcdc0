#include "setup/surfaces/face_shares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "body/partition/near_ranks.hpp"
#include "families/families.hpp"
#include "perikit/core/exact_sum.hpp"
#include "setup/surfaces/first_moments.hpp"
#include "setup/surfaces/free_surface.hpp"
#include "setup/surfaces/outer_layer.hpp"

namespace perikit {

namespace {

/// By point.
struct Share {
  double area = 0;
  std::int32_t group = 0;  ///< of the samples
};
using Shares = std::map<std::int32_t, Share>;

FaceShares in_order(const Shares& shares, SurfaceSamples samples) {
  FaceShares all;
  for (const auto& [p, share] : shares) {
    all.points.push_back(p);
    all.share.push_back(share.area);
    samples.group.push_back(share.group);
  }
  all.samples = std::move(samples);
  return all;
}

/// A face of a load's set.
struct Face {
  int axis;
  double outward;  ///< 1: upper face, -1: lower
  UnitStress unit;
  explicit Face(const LoadDescription& load)
      : axis(load.face[1] - 'x'),
        outward(load.face[0] == '+' ? 1.0 : -1.0),
        unit(load.type == LoadDescription::Type::pressure ? UnitStress::all_around : UnitStress::along_axis) {}
};

/// An end of a column of cells along the axis of a face: a point with none before it, or none behind it.
struct End {
  Point x;
  std::array<std::int64_t, 3> cell;  ///< of the whole lattice
  std::int64_t kind;                 ///< bits below
  static constexpr std::int64_t outer = 1, inner = 2, chosen = 4, image = 8;
};

/// The columns of a lattice along the outward normal of a face.
class Columns {
 public:
  /// points: of the load, with images where these carry something, too. Finds their ends on all ranks, which must call it; no
  /// column is followed farther than `most` cells.
  Columns(const Body& body, const Face& face, const std::vector<std::int32_t>& points, const ImageMap* images, std::int64_t most)
      : lattice_(*body.lattice()), body_(body), most_(most) {
    while (lattice_.axis[axis_] != face.axis) ++axis_;
    sign_ = face.outward > 0 ? 1 : -1;
    std::vector<std::uint8_t> chosen(body.stride(), 0);
    for (const std::int32_t p : points) chosen[static_cast<std::size_t>(p)] = 1;
    complete_.assign(body.stride(), 0);
    for (const std::int32_t p : body.complete()) complete_[static_cast<std::size_t>(p)] = 1;
    std::vector<End> mine;
    const auto add = [&](std::span<const std::int32_t> of, std::int64_t kind) {
      for (const std::int32_t p : of) {
        const std::int64_t ends = (lives(p, sign_) ? 0 : End::outer) | (lives(p, -sign_) ? 0 : End::inner);
        if (ends == 0) continue;
        std::array<std::int64_t, 3> cell = lattice_.cell(p);
        for (std::size_t a = 0; a < 3; ++a) cell[a] += lattice_.first[a];
        mine.push_back({lattice_.position(p), cell, ends | kind | (chosen[static_cast<std::size_t>(p)] ? End::chosen : 0)});
      }
    };
    add(body.owned(), 0);
    if (images) {
      std::vector<std::int32_t> all = body.owned();
      images->append_images(all);
      add(std::span(all).subspan(body.owned().size()), End::image);
    }
    std::vector<std::array<std::int64_t, 3>> others;   // at the face, but not of the load
    for (const End& end : of_ranks_near(body, mine, static_cast<double>(most) * lattice_.spacing)) {
      if (end.kind & End::inner) inner_.push_back({column(end.cell), sign_ * end.cell[axis_]});
      if (end.kind & End::outer) {
        if (end.kind & End::chosen) faces_.push_back(end);
        else others.push_back(end.cell);
      }
    }
    std::ranges::sort(inner_);
    std::ranges::sort(others);
    part_ = counted(std::ranges::any_of(faces_, [&](const End& end) { return beside(end, others); }) ? 1 : 0).all > 0;
    own_faces_ = std::ranges::count_if(mine, [](const End& end) {
      return (end.kind & End::outer) && (end.kind & End::chosen) && !(end.kind & End::image);
    });
  }
  /// Whether the face goes on beside the points of the load.
  bool part() const noexcept { return part_; }
  /// The ends at the face.
  const std::vector<End>& faces() const noexcept { return faces_; }
  /// How many of them are points of this rank.
  std::int64_t own_faces() const noexcept { return own_faces_; }
  /// Points from an end on inwards, counted as far as `most`.
  std::int64_t depth(const End& end) const {
    const std::pair place(column(end.cell), sign_ * end.cell[axis_]);
    const auto after = std::ranges::upper_bound(inner_, place);
    if (after == inner_.begin() || std::prev(after)->first != place.first) return most_;
    return std::min(most_, place.second - std::prev(after)->second + 1);
  }
  /// The point k steps further in than an end; -1: one whose forces are not complete here.
  std::int32_t below(const End& end, std::int64_t k) const noexcept {
    std::array<std::int64_t, 3> cell = end.cell;
    cell[axis_] -= sign_ * k;
    for (std::size_t a = 0; a < 3; ++a) {
      cell[a] -= lattice_.first[a];
      if (cell[a] < 0 || cell[a] >= lattice_.extent[a]) return -1;
    }
    const std::int64_t index = lattice_.index(cell[0], cell[1], cell[2]);
    return complete_[static_cast<std::size_t>(index)] ? static_cast<std::int32_t>(index) : -1;
  }

 private:
  /// Whether there is a point behind p. A dead cell beyond the last row may be outside of the padding where the family has no reach
  /// along this axis.
  bool lives(std::int32_t p, int sign) const {
    std::array<std::int64_t, 3> cell = lattice_.cell(p);
    std::array<int, 3> step{};
    step[axis_] = sign;
    cell[axis_] += sign;
    if (cell[axis_] < 0 || cell[axis_] >= lattice_.extent[axis_]) return false;
    return body_.alive(static_cast<std::size_t>(p + lattice_.shift(step)));
  }
  /// Whether one of the cells has a side in common with the end.
  bool beside(const End& end, const std::vector<std::array<std::int64_t, 3>>& cells) const {
    for (std::size_t a = 0; a < 3; ++a)
      for (const int step : {-1, 1}) {
        std::array<std::int64_t, 3> cell = end.cell;
        cell[a] += step;
        if (a != axis_ && std::ranges::binary_search(cells, cell)) return true;
      }
    return false;
  }
  /// A number of the column of a cell of the whole lattice.
  std::int64_t column(std::array<std::int64_t, 3> cell) const noexcept {
    cell[axis_] = 0;
    return cell[0] + lattice_.whole[0] * (cell[1] + lattice_.whole[1] * cell[2]);
  }

  const Lattice& lattice_;
  const Body& body_;
  std::int64_t most_;
  std::size_t axis_ = 0;
  int sign_ = 1;
  std::vector<End> faces_;
  std::vector<std::pair<std::int64_t, std::int64_t>> inner_;  ///< column, and how far out it begins
  std::vector<std::uint8_t> complete_;                        ///< by internal index
  std::int64_t own_faces_ = 0;
  bool part_ = false;
};

/// Each column of cells below the face carries what the kinematics has of it there: a homogeneous stress is then in equilibrium
/// point by point. (On clouds no load on faces alone does that.) Bonds of pair laws near a face may have another stress than those inside: what they
/// have of the face is given the total and the first moments of its cells. Local force states have no areas: the face lies half a spacing beyond the last
/// layer, and 3/2 there and -1/2 one layer further in give the exact total and the exact moment.
/// Of a part of a body with all ranks, which must all call it.
FaceShares on_lattice(std::vector<std::int32_t> points, const Face& face, const TermParts& parts, const ImageMap* images) {
  const Body& body = parts.families->body();
  const bool exact = parts.formulation.force_state == ForceState::variational;
  const Field areas = exact ? face_areas(parts, face.axis, face.unit) : Field();
  const auto layers = static_cast<std::int64_t>(std::ceil(3 * body.horizon() / body.spacing()));  // that a face is felt in
  const double area = body.uniform_volume() / body.spacing();
  if (exact && images) images->append_images(points);   // what the evaluation points of the set have of the face beyond its edges
  const Columns columns(body, face, points, images, 2 * layers);
  Shares shares;
  ExactSum total;
  SurfaceSamples samples;
  std::int32_t group = 0;
  std::vector<std::int32_t> groups;
  std::int64_t thin = 0;   // columns of this rank that the opposite face reaches into; of pair laws none: their areas across the middle of a column are whole
  const auto add = [&](std::int32_t p, double share) {
    if (p < 0) return;
    shares[p].area += share;
    shares[p].group = group;
    if (body.owns(static_cast<std::size_t>(p))) total.add(share);
  };
  for (const End& end : columns.faces()) {
    const std::int64_t depth = columns.depth(end);
    Point middle = end.x;
    middle[static_cast<std::size_t>(face.axis)] += 0.5 * face.outward * body.spacing();
    const std::int32_t outermost = columns.below(end, 0);
    const bool mine = !(end.kind & End::image) && outermost >= 0 && body.owns(static_cast<std::size_t>(outermost));
    group = add_cell(body.dimension(), face.axis, middle, body.spacing(), mine ? area : 0.0, samples);
    groups.push_back(group);
    if (!exact || (depth == 1 && !(end.kind & End::image))) {
      add(columns.below(end, 0), depth > 1 ? 1.5 * area : area);
      if (depth > 1) add(columns.below(end, 1), -0.5 * area);
      continue;
    }
    thin += !parts.formulation.pairs && mine && depth < 2 * layers;
    // What is nearer to the opposite face belongs to that one.
    for (std::int64_t k = 0; k < std::min(layers, depth / 2); ++k)
      if (const std::int32_t p = columns.below(end, k); p >= 0) add(p, face.outward * areas.data()[p]);
  }
  const double wanted = static_cast<double>(counted(columns.own_faces()).all) * area, found = total_of(body, total);
  const auto finished = [&] {
    FaceShares all = in_order(shares, std::move(samples));
    if (exact && !images && (columns.part() || parts.formulation.pairs)) give_first_moments(body, all.points, all.samples, all.share);
    return all;
  };
  if (!exact) return finished();
  if (thin = counted(thin).all; thin > 0) {
    // Parts of this face beyond the middle are missing, and there are as large ones of the opposite face: the first moment of the half is right, its sum is not.
    // What the sum lacks acts in the middle of the columns. It has no moment there, and under the same stress on both faces it cancels.
    const double lack = (wanted - found) / static_cast<double>(thin);
    for (std::size_t n = 0; n < groups.size(); ++n) {
      const End& end = columns.faces()[n];
      const std::int64_t depth = columns.depth(end);
      if ((end.kind & End::image) || depth == 1 || depth >= 2 * layers) continue;
      group = groups[n];
      for (const std::int64_t k : {(depth - 1) / 2, depth / 2}) add(columns.below(end, k), 0.5 * lack);
    }
    return finished();
  }
  for (auto& [p, share] : shares) share.area *= wanted / found;
  return finished();
}

/// The points of a cloud at a face. Of a part of a body all ranks must call it.
class Layer {
 public:
  Layer(const std::vector<std::int32_t>& points, const Face& face, const Body& body) : body_(body), face_(face) {
    double extreme = -std::numeric_limits<double>::infinity(), highest = extreme, lowest = -extreme;
    for (const std::int32_t p : points) extreme = std::max(extreme, along(p));
    for (const std::int32_t p : body.internal()) {
      highest = std::max(highest, along(p));
      lowest = std::min(lowest, along(p));
    }
    at_ = largest(extreme);
    thickness_ = largest(highest) + largest(-lowest);
    const OuterLayer layer = outer_layer(body.spacing(), body.part(), [&](const auto& visit) {
      for (const std::int32_t p : body.owned())
        if (along(p) <= at_ + 1e-9 * body.spacing()) visit(at_ - along(p), body.volume(static_cast<std::size_t>(p)));
    });
    if (layer.clear() && layer.half_cells()) {
      double next = std::numeric_limits<double>::infinity();  // layer
      for (const std::int32_t p : body.owned())
        if (const double d = at_ - along(p); d > 0.4 * body.spacing()) next = std::min(next, d);
      cell_ = -0.5 * largest(-next);
      outer_ = 0.05 * body.spacing();
      behind_ = 0;
    } else {
      cell_ = body.spacing();
      at_ += 0.5 * cell_;
      outer_ = 1.2 * cell_;
      behind_ = 2.2 * cell_;
    }
  }
  double depth(std::int32_t p) const { return at_ - along(p); }
  bool outer(std::int32_t p) const { return depth(p) <= outer_; }
  bool second(std::int32_t p) const { return !outer(p) && depth(p) <= behind_; }
  /// Of the face, where the point is one of the outer layer.
  double area(std::int32_t p) const { return body_.volume(static_cast<std::size_t>(p)) / cell_; }
  double thickness() const noexcept { return thickness_; }
  /// Whether volumes say what the area of the face is; where points lie on it, evaluation points know better.
  bool whole_cells() const noexcept { return behind_ > 0; }
  Point foot(std::int32_t p) const {
    Point x = body_.position(static_cast<std::size_t>(p));
    x[static_cast<std::size_t>(face_.axis)] += face_.outward * depth(p);
    return x;
  }

 private:
  double along(std::int32_t p) const { return face_.outward * body_.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(face_.axis)]; }
  double largest(double value) const { return body_.part() ? communicator().largest(value) : value; }

  const Body& body_;
  const Face& face_;
  double at_ = 0;         ///< of the face, along the outward normal
  double thickness_ = 0;  ///< of the body with its images: no face is where these are
  double cell_ = 0;       ///< thickness of the cells of the outer layer
  double outer_ = 0, behind_ = 0;  ///< depths at which the outer and the second layer end
};

/// What the kinematics has of the face, where a homogeneous stress is in equilibrium inside of the cloud: below each point of the outer layer that
/// is of the set, and images of these points with what the evaluation points have of the face beyond its edges.
Shares by_kinematics(const std::vector<std::int32_t>& points, const Face& face, const Layer& layer, const TermParts& parts, const ImageMap* images) {
  const Body& body = parts.families->body();
  const Field areas = face_areas(parts, face.axis, face.unit);
  std::vector<std::uint8_t> in_set(body.stride(), 0);
  for (const std::int32_t p : points) in_set[static_cast<std::size_t>(p)] = 1;
  std::vector<SurfacePoint> outer;
  for (const std::int32_t p : body.owned())
    if (const auto i = static_cast<std::size_t>(p); layer.outer(p) && layer.depth(p) >= -1e-9 * body.spacing())
      outer.push_back({body.position(i), in_set[i]});
  const double felt = 3 * body.horizon();  // a face is felt no deeper
  const double deepest = std::min(felt, 0.5 * layer.thickness()) + 1e-6 * body.spacing();
  Shares shares;
  for (const auto& [p, share] : points_below(body, outer, felt, images, [&](std::int32_t p) { return layer.depth(p) <= deepest; }))
    shares[p].area = face.outward * share * areas.data()[p];
  return shares;
}

/// By volumes: the outer layer has the area of the face, its volumes over the thickness of its cells. Where the set holds a second layer of whole
/// cells, linear weights over both put the resultant on the face.
Shares by_volumes(const std::vector<std::int32_t>& points, const Layer& layer, const Body& body) {
  ExactSum areas, volumes, moments, squares;
  bool second = false;
  for (const std::int32_t p : points) {
    const double depth = layer.depth(p), v = body.volume(static_cast<std::size_t>(p));
    if (!layer.outer(p) && !layer.second(p)) continue;
    if (layer.outer(p))
      areas.add(layer.area(p));
    else
      second = true;
    volumes.add(v);
    moments.add(v * depth);
    squares.add(v * depth * depth);
  }
  if (body.part()) second = communicator().largest(second ? 1 : 0) > 0;
  const double total = total_of(body, areas), m0 = total_of(body, volumes), m1 = total_of(body, moments), m2 = total_of(body, squares);
  Shares shares;
  for (const std::int32_t p : points) {
    const double depth = layer.depth(p), v = body.volume(static_cast<std::size_t>(p));
    if (!layer.outer(p) && !layer.second(p)) continue;
    shares[p].area = second ? total * v * (m2 - m1 * depth) / (m0 * m2 - m1 * m1) : total * v / m0;
  }
  return shares;
}

/// Points on a face take what a consistent cloud has of it; other clouds go by their volumes. Bonds of pair laws have areas on every cloud; their sum and their
/// first moments are those that volumes say. Of a part of a body all ranks must call it.
FaceShares on_cloud(const std::vector<std::int32_t>& points, const Face& face, const TermParts& parts, const ImageMap* images) {
  const Body& body = parts.families->body();
  const Layer layer(points, face, body);
  ExactSum of_layer;
  for (const std::int32_t p : points)
    if (layer.outer(p)) of_layer.add(layer.area(p));
  const double seen = total_of(body, of_layer);
  const auto carried = [&](const Shares& shares) {
    ExactSum sum;
    for (const auto& [p, share] : shares)
      if (body.owns(static_cast<std::size_t>(p))) sum.add(share.area);
    return total_of(body, sum);
  };
  Shares shares;
  bool pairs = parts.formulation.pairs != nullptr;
  if (pairs) {
    shares = by_kinematics(points, face, layer, parts, images);
    const double ratio = carried(shares) / seen;
    pairs = ratio > 0.5 && ratio < 2;   // else a face inside of the body, or one of few points
    for (auto& [p, share] : shares) share.area /= ratio;
  }
  if (!pairs) shares = parts.consistency && !layer.whole_cells() ? by_kinematics(points, face, layer, parts, images) : by_volumes(points, layer, body);
  const double scale = pairs ? 1.0 : carried(shares) / seen;
  SurfaceSamples samples;
  const auto add_group = [&](std::int32_t p, double area) {  // a point of the outer layer has a square cell of the face
    const double side = body.dimension() == 2 ? area / body.frame().section : std::sqrt(area);
    return add_cell(body.dimension(), face.axis, layer.foot(p), side, area, samples);
  };
  std::map<std::int32_t, std::int32_t> group;
  for (const std::int32_t p : points)
    if (layer.outer(p)) group[p] = add_group(p, scale * layer.area(p));
  for (auto& [p, share] : shares) share.group = group.contains(p) ? group.at(p) : add_group(p, 0.0);
  FaceShares all = in_order(shares, std::move(samples));
  if (pairs && !images) give_first_moments(body, all.points, all.samples, all.share);
  return all;
}

}  // namespace

FaceShares face_shares(const LoadDescription& load, const TermParts& parts, const ImageMap* images) {
  const Face face(load);
  const std::vector<std::int32_t>& points = parts.families->body().set(load.set);
  FaceShares shares = parts.families->body().lattice() ? on_lattice(points, face, parts, images) : on_cloud(points, face, parts, images);
  if (counted(std::ssize(shares.points)).all == 0 && communicator().complete()) {
    throw InputError(
        load.position, "load.face",
        fmt::format("found \"{}\", on which no point of the set \"{}\" lies; allowed: a face of the set", load.face, load.set));
  }
  return shares;
}

}  // namespace perikit
