#include "setup/body/thin_pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/symmetric_matrix.hpp"
#include "families/shape_tensor.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"

namespace perikit {

namespace {

/// sum of xi (x) xi over the bonds.
void add_directions(const FamilyArrays& family, int d, std::array<double, 9>& sum) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k)
    for (int a = 0; a < d; ++a)
      for (int b = 0; b < d; ++b) sum[static_cast<std::size_t>(a * d + b)] += family.xi[a][k] * family.xi[b][k];
}

bool spans(const FamilyArrays& family, int d) {
  std::array<double, 9> sum{};
  add_directions(family, d, sum);
  // By the determinant where that is enough: of the eigenvalues l1 <= l2 <= l3 the trace t is at least l3 and at least 2 sqrt(l2 l3), so that l1 >= 4 det/t^2.
  if (d == 3) {
    const auto& [xx, xy, xz, yx, yy, yz, zx, zy, zz] = sum;
    const double trace = xx + yy + zz, determinant = xx * (yy * zz - yz * zy) - xy * (yx * zz - yz * zx) + xz * (yx * zy - yy * zx);
    if (4 * determinant > 2 * singular_ratio * trace * trace * trace) return true;
  }
  const SymmetricEigen eigen(d, sum.data(), false);
  return eigen.largest() > 0 && eigen.least() > singular_ratio * eigen.largest();
}

class ThinPieces {
 public:
  ThinPieces(const Families& families, Ghosts* ghosts) : families_(families), body_(families.body()), ghosts_(ghosts) {}

  /// The points of this rank in pieces that are one point thick; single points without bonds are left out.
  std::vector<std::int32_t> find() {
    joined_ = body_.make_field(1);
    std::vector<std::int32_t> thin;  // of this rank, without a family that spans all dimensions
    families_.each_class([&](std::span<const std::int32_t> points) {
      families_.load(static_cast<std::size_t>(points.front()), BondsOf::uncut, family_);
      const bool whole = spans(family_, body_.dimension());
      for (const std::int32_t p : points) {
        if (whole) joined_.data()[p] = 1;
        else if (body_.owns(static_cast<std::size_t>(p)) && !body_.image(static_cast<std::size_t>(p))) thin.push_back(p);
      }
    });
    if (!of_any(!thin.empty())) return {};
    std::ranges::sort(thin);
    // A thin point is joined to the rest where one of its family is. Values of other ranks' points come after each round.
    for (bool more = true; more;) {
      if (ghosts_) ghosts_->forward(joined_);
      more = of_any(join(thin));
    }
    std::erase_if(thin, [&](std::int32_t p) { return joined_.data()[p] != 0 || bonds(p) == 0; });
    return thin;
  }

 private:
  static bool of_any(bool mine) { return communicator().largest(mine ? 1 : 0) > 0; }
  int bonds(std::int32_t p) {
    families_.load(static_cast<std::size_t>(p), BondsOf::uncut, family_);
    return family_.bonds;
  }
  /// Spreads from joined points over thin ones. Returns whether it has found any.
  bool join(const std::vector<std::int32_t>& thin) {
    std::vector<std::int32_t> found;
    const auto is_joined = [&](std::int32_t p) { return joined_.data()[p] != 0; };
    for (const std::int32_t p : thin) {
      if (is_joined(p)) continue;
      const int count = bonds(p);
      if (!std::any_of(family_.far.begin(), family_.far.begin() + count, is_joined)) continue;
      joined_.data()[p] = 1;
      found.push_back(p);
    }
    const bool any = !found.empty();
    while (!found.empty()) {
      const int count = bonds(found.back());
      found.pop_back();
      for (int k = 0; k < count; ++k) {
        const std::int32_t q = family_.far[static_cast<std::size_t>(k)];
        if (is_joined(q) || !std::ranges::binary_search(thin, q)) continue;
        joined_.data()[q] = 1;
        found.push_back(q);
      }
    }
    return any;
  }

  const Families& families_;
  const Body& body_;
  Ghosts* ghosts_;
  Field joined_;  ///< 1: of a piece that is thick somewhere
  FamilyArrays family_;
};

/// A thin point, as ranks tell each other of it.
struct ThinPoint {
  std::int64_t number;
  Point x;
  Point across;    ///< a direction in which its family does not extend
  double volume;
  int extent;      ///< dimensions that its family spans
};

ThinPoint thin_point(const Families& families, std::int32_t index) {
  const Body& body = families.body();
  const auto p = static_cast<std::size_t>(index);
  const int d = body.dimension();
  FamilyArrays family;
  families.load(p, BondsOf::uncut, family);
  std::array<double, 9> sum{};
  add_directions(family, d, sum);
  const SymmetricEigen eigen(d, sum.data());
  ThinPoint point{body.number(p), body.position(p), {}, body.volume(p), 0};
  for (int k = 0; k < d; ++k) point.extent += eigen.value(k) > singular_ratio * eigen.largest() ? 1 : 0;
  for (int a = 0; a < d; ++a) point.across[static_cast<std::size_t>(a)] = eigen.vector(a, 0);
  return point;
}

std::string direction(const ThinPoint& point, int dimension) {
  std::string axes;
  for (int a = 0; a < dimension; ++a)
    if (std::abs(point.across[static_cast<std::size_t>(a)]) > 1 - 1e-6) axes = std::string(1, "xyz"[a]);
  return axes.empty() ? fmt::format("({:.3g}, {:.3g}, {:.3g})", point.across[0], point.across[1], point.across[2]) : axes;
}

/// The remedy: the body in as many dimensions as its points span, with the section that its volumes have then.
std::string remedy(const Scene& scene, const ThinPoint& point, double spacing) {
  const auto section = [&](const char* name, double value) { return scene.body.lattice ? fmt::format("{} = {:.6g}", name, value) : fmt::format("{} = ...", name); };
  if (point.extent == 2) return fmt::format("dimension = 2, plane = \"stress\", {}, or several points across", section("thickness", point.volume / (spacing * spacing)));
  return fmt::format("dimension = 1, {}, or several points across", section("area", point.volume / spacing));
}

/// Chips that `inside` cuts off at the edge of a body are no part of what it was built for: pieces with up to this share of its volume, all together.
constexpr double share_of_chips = 0.01;

double volume_of(const Body& body, std::span<const std::int32_t> points) {
  ExactSum sum;
  for (const std::int32_t p : points) sum.add(body.volume(static_cast<std::size_t>(p)));
  return total_over_ranks(sum);
}

}  // namespace

void refuse_thin_pieces(const Scene& scene, const Families& families, Ghosts* ghosts, std::vector<std::string>& warnings) {
  const Body& body = families.body();
  if (body.dimension() == 1 || !communicator().complete()) return;
  if (families.needs().shapes && communicator().largest(static_cast<double>(families.singular())) == 0) return;
  const std::vector<std::int32_t> mine = ThinPieces(families, ghosts).find();
  const Counted count = counted(std::ssize(mine));
  if (count.all == 0) return;
  std::vector<ThinPoint> firsts;  // of each rank the one with the lowest number
  const auto number = [&](std::int32_t p) { return body.number(static_cast<std::size_t>(p)); };
  if (!mine.empty()) firsts.push_back(thin_point(families, *std::ranges::min_element(mine, {}, number)));
  firsts = told_to_all(gathered<ThinPoint>(firsts));
  const ThinPoint first = *std::ranges::min_element(firsts, {}, &ThinPoint::number);
  const double share = volume_of(body, mine) / volume_of(body, body.owned());
  if (share <= share_of_chips) {
    warnings.push_back(named("thin", fmt::format("{} points in pieces that are one point thick, {:.2g} of the volume of the body, the first one at ({:.6g}, {:.6g}, {:.6g}): no "
                                   "bond joins them to the rest, and what they store depends on the kinematics, not on the material; `inside` may leave them out",
                                   count.all, share, first.x[0], first.x[1], first.x[2])));
    return;
  }
  const bool whole = count.all == static_cast<std::int64_t>(body.points_of_all_ranks());
  throw InputError(
      scene.body.position, "body.dimension",
      fmt::format("found {} in {} dimensions that is one point thick along {}{}: no family has a gradient in that direction; allowed: {}",
                  whole ? "a body" : fmt::format("a piece of the body, at ({:.6g}, {:.6g}, {:.6g}),", first.x[0], first.x[1], first.x[2]), body.dimension(),
                  direction(first, body.dimension()), whole ? "" : fmt::format(" ({} such points)", count.all), remedy(scene, first, body.spacing())));
}

}  // namespace perikit
