#include "build/face_shares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "families/families.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

using Shares = std::map<std::int32_t, double>;

/// A face of a load's set.
struct Face {
  int axis;
  double outward;  ///< 1: upper face, -1: lower
  explicit Face(const LoadDescription& load) : axis(load.face[1] - 'x'), outward(load.face[0] == '+' ? 1.0 : -1.0) {}
};

/// Steps along the outward normal of a face of a lattice.
class Columns {
 public:
  Columns(const Body& body, const Face& face) : body_(body), lattice_(*body.lattice()) {
    for (std::size_t k = 0; k < 3; ++k) step_[k] = lattice_.axis[k] == face.axis ? static_cast<int>(face.outward) : 0;
    shift_ = lattice_.shift(step_);
  }
  /// The point k steps further in than p.
  std::int32_t below(std::int32_t p, std::int64_t k) const noexcept { return static_cast<std::int32_t>(p - k * shift_); }
  bool at_face(std::int32_t p) const { return !neighbour_alive(p, 1); }
  /// Points from p on inwards, counted as far as `most`.
  std::int64_t depth(std::int32_t p, std::int64_t most) const {
    std::int64_t depth = 1;
    while (depth < most && neighbour_alive(below(p, depth - 1), -1)) ++depth;
    return depth;
  }

 private:
  /// A dead cell beyond the last row may be outside of the padding where the family has no reach along this axis.
  bool neighbour_alive(std::int64_t p, int sign) const {
    std::array<std::int64_t, 3> k = lattice_.cell(p);
    for (std::size_t a = 0; a < 3; ++a) {
      k[a] += sign * step_[a];
      if (k[a] < 0 || k[a] >= lattice_.extent[a]) return false;
    }
    return body_.alive(static_cast<std::size_t>(p + sign * shift_));
  }

  const Body& body_;
  const Lattice& lattice_;
  std::array<int, 3> step_{};
  std::int64_t shift_ = 0;
};

/// Each column of cells below the face carries what the kinematics has of it there: a homogeneous stress is then in equilibrium
/// point by point. (On clouds no load on faces alone does that.) Pair laws have no homogeneous stress near a face: the face lies
/// half a spacing beyond the last layer, and 3/2 there and -1/2 one layer further in give the exact total and the exact moment.
Shares on_lattice(std::vector<std::int32_t> points, const Face& face, const TermParts& parts, const ImageMap* images) {
  const Body& body = parts.families->body();
  const Columns columns(body, face);
  const bool exact = !parts.formulation.pairs && parts.formulation.force_state == ForceState::variational;
  const Field areas = exact ? face_areas(parts, face.axis) : Field();
  const auto layers = static_cast<std::int64_t>(std::ceil(3 * body.horizon() / body.spacing()));  // that a face is felt in
  const double area = body.uniform_volume() / body.spacing();
  const std::size_t own_points = points.size();
  if (exact && images) images->append_images(points);   // what the evaluation points of the set have of the face beyond its edges
  Shares shares;
  double total = 0, wanted = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const std::int32_t p = points[n];
    if (!columns.at_face(p)) continue;
    if (n < own_points) wanted += area;
    const std::int64_t depth = columns.depth(p, 2 * layers);
    if (!exact || (depth == 1 && n < own_points)) {
      shares[p] += depth > 1 ? 1.5 * area : area;
      if (depth > 1) shares[columns.below(p, 1)] -= 0.5 * area;
      total += area;
      continue;
    }
    // What is nearer to the opposite face belongs to that one.
    for (std::int64_t k = 0; k < std::min(layers, depth / 2); ++k) {
      const double own = face.outward * areas.data()[columns.below(p, k)];
      shares[columns.below(p, k)] += own;
      total += own;
    }
  }
  for (auto& [p, value] : shares) value *= wanted / total;
  return shares;
}

/// A cloud: points less than 1.2 spacings below the face are its outer layer, and their volumes over the spacing its area. Where
/// the set holds a second layer, linear weights over both put the resultant on the face. Of a part of a body that is found with
/// all ranks, which must all call it.
Shares on_cloud(const std::vector<std::int32_t>& points, const Face& face, const Body& body) {
  const double dx = body.spacing();
  const auto along = [&](std::int32_t p) {
    return face.outward * body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(face.axis)];
  };
  const auto largest = [&](double value) { return body.part() ? communicator().largest(value) : value; };
  const auto value_of = [&](ExactSum& sum) { return body.part() ? total_over_ranks(sum) : sum.value(); };
  double extreme = -std::numeric_limits<double>::infinity();
  for (const std::int32_t p : points) extreme = std::max(extreme, along(p));
  extreme = largest(extreme);
  ExactSum areas, volumes, moments, squares;
  bool second = false;
  for (const std::int32_t p : points) {
    const double depth = extreme + 0.5 * dx - along(p), v = body.volume(static_cast<std::size_t>(p));
    if (depth > 2.2 * dx) continue;
    if (depth <= 1.2 * dx)
      areas.add(v / dx);
    else
      second = true;
    volumes.add(v);
    moments.add(v * depth);
    squares.add(v * depth * depth);
  }
  second = largest(second ? 1 : 0) > 0;
  const double total = value_of(areas), m0 = value_of(volumes), m1 = value_of(moments), m2 = value_of(squares);
  Shares shares;
  for (const std::int32_t p : points) {
    const double depth = extreme + 0.5 * dx - along(p), v = body.volume(static_cast<std::size_t>(p));
    if (depth > 2.2 * dx) continue;
    shares[p] = second ? total * v * (m2 - m1 * depth) / (m0 * m2 - m1 * m1) : total * v / m0;
  }
  return shares;
}

}  // namespace

Shares face_shares(const LoadDescription& load, const TermParts& parts, const ImageMap* images) {
  const Face face(load);
  const std::vector<std::int32_t>& points = parts.families->body().set(load.set);
  Shares shares = parts.families->body().lattice() ? on_lattice(points, face, parts, images) : on_cloud(points, face, parts.families->body());
  if (counted(std::ssize(shares)).all == 0 && communicator().complete()) {
    throw InputError(
        load.position, "load.face",
        fmt::format("found \"{}\", on which no point of the set \"{}\" lies; allowed: a face of the set", load.face, load.set));
  }
  return shares;
}

}  // namespace perikit
