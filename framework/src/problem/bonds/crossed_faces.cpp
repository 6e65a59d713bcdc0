#include "problem/bonds/crossed_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "body/points/point_arithmetic.hpp"

namespace perikit {

namespace {

constexpr double cracked = 0.25;         ///< damage from which a point may lie at a face
constexpr double least_closing = 0.01;   ///< over the distance of both sides
constexpr double least_distance = 0.75;  ///< of both sides, over the mean length of the bonds: less is no face

/// Mean of some bonds of a family, at rest and as they are.
struct Side {
  Point rest{}, now{};
  double bonds = 0;

  void add(const Point& xi, const Point& y) {
    ++bonds;
    for (std::size_t c = 0; c < 3; ++c) {
      rest[c] += (xi[c] - rest[c]) / bonds;
      now[c] += (y[c] - now[c]) / bonds;
    }
  }
};

/// How much closer the lost side has come to the one that is left, over their distance at rest and beyond twice the largest compression of a bond
/// that is left. The distance counts as negative where the lost side has come to the other side of the point.
double closing(const Side& lost, const Side& left, double mean_length, double least_stretch) {
  if (lost.bonds == 0 || left.bonds == 0) return 0;
  Point before{}, after{};
  for (std::size_t c = 0; c < 3; ++c) {
    before[c] = lost.rest[c] - left.rest[c];
    after[c] = lost.now[c] - left.now[c];
  }
  const double at_rest = std::sqrt(dot(before, before)), now = std::copysign(std::sqrt(dot(after, after)), -dot(after, left.now));
  return at_rest >= least_distance * mean_length ? 1 + 2 * std::min(0.0, least_stretch) - now / at_rest : 0.0;
}

}  // namespace

CrossedFaces find_crossed_faces(const Families& families, ConstFieldView u) {
  const Body& body = families.body();
  CrossedFaces found;
  FamilyArrays uncut, intact;
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    if (families.damage(p) < cracked) continue;
    families.load(p, BondsOf::uncut, uncut);
    families.load(p, BondsOf::intact, intact);
    Side lost, left;
    double lengths = 0, least_stretch = 0;
    std::size_t next = 0;   // both lists ascend by their far ends
    for (std::size_t k = 0; k < uncut.far.size(); ++k) {
      Point xi{}, y{};
      for (std::size_t c = 0; c < static_cast<std::size_t>(u.components); ++c) {
        const double* const component = u.component(static_cast<int>(c));
        xi[c] = uncut.xi[c][k];
        y[c] = xi[c] + component[uncut.far[k]] - component[p];
      }
      lengths += uncut.length[k];
      const bool is_left = next < intact.far.size() && intact.far[next] == uncut.far[k];
      (is_left ? left : lost).add(xi, y);
      if (!is_left) continue;
      ++next;
      least_stretch = std::min(least_stretch, std::sqrt(dot(y, y)) / uncut.length[k] - 1);
    }
    const double closer = closing(lost, left, lengths / static_cast<double>(uncut.far.size()), least_stretch);
    if (closer <= least_closing) continue;
    ++found.points;
    found.deepest = std::max(found.deepest, closer);
  }
  return found;
}

}  // namespace perikit
