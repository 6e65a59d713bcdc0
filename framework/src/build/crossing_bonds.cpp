#include "build/crossing_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "perikit/core/rank_values.hpp"
#include "terms/energy_shares.hpp"

namespace perikit {

namespace {

/// A whole family of a regular lattice with the spacing of the body.
FamilyArrays regular_family(const Families& families) {
  const Body& body = families.body();
  Lattice lattice;
  lattice.dimension = body.dimension();
  lattice.spacing = body.spacing();
  const auto d = static_cast<std::size_t>(body.dimension());
  for (std::size_t a = 0; a < 3; ++a) lattice.extent[a] = a < d ? std::int64_t{1} << 20 : 1;
  const auto offsets = family_offsets(lattice, body.horizon());
  FamilyArrays family;
  family.resize(body.dimension(), static_cast<int>(offsets.size()));
  std::vector<double> r, omega(offsets.size(), 1.0);
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    double square = 0;
    for (std::size_t a = 0; a < d; ++a) {
      family.xi[a][k] = offsets[k][a] * body.spacing();
      square += family.xi[a][k] * family.xi[a][k];
    }
    family.length[k] = std::sqrt(square);
    family.volume[k] = body.section() * std::pow(body.spacing(), body.dimension());
    r.push_back(std::min(1.0, family.length[k] / body.horizon()));
  }
  if (families.needs().influence) families.influence()->evaluate(r, omega);
  std::copy(omega.begin(), omega.end(), family.omega.begin());
  return family;
}

/// length(k): xi.n of bond k on the average over what is counted, 0 where it does not cross.
template <class Length>
CrossingBonds count(const FamilyArrays& family, const AlignedVector<double>& share, const Length& length) {
  CrossingBonds crossing;
  for (std::size_t k = 0; k < family.far.size(); ++k) {
    crossing.plain += family.volume[k] * length(k);
    crossing.shares += share[k] * family.volume[k] * length(k);
  }
  return crossing;
}

/// Of one point of a cloud, by its number in the whole body.
struct OfPoint {
  std::int64_t number;
  CrossingBonds crossing;
};

/// The mean over the points of all ranks, in their order; nothing where there are none. All ranks must call it.
std::optional<CrossingBonds> mean_of_all(const std::vector<OfPoint>& mine) {
  std::vector<OfPoint> all = gathered<OfPoint>(mine);
  std::ranges::sort(all, {}, &OfPoint::number);
  CrossingBonds sum;
  for (const OfPoint& point : all) {
    sum.plain += point.crossing.plain;
    sum.shares += point.crossing.shares;
  }
  const auto points = static_cast<double>(all.size());
  const std::vector<CrossingBonds> mean = told_to_all(all.empty() ? std::vector<CrossingBonds>() : std::vector{CrossingBonds{sum.plain / points, sum.shares / points}});
  if (mean.empty()) return std::nullopt;
  return mean.front();
}

double ball_volume(const Body& body) {
  constexpr double unit[] = {0, 2, std::numbers::pi, 4 * std::numbers::pi / 3};
  return body.section() * unit[body.dimension()] * std::pow(body.horizon(), body.dimension());
}

}  // namespace

CrossingBonds crossing_bonds(const Families& families, const Formulation& formulation) {
  const Body& body = families.body();
  const int d = body.dimension();
  AlignedVector<double> share;
  // Half of the mean of |cos| over all directions: 1/4 in 3D, 1/pi in 2D, 1/2 in 1D.
  const double mean = d == 3 ? 0.25 : d == 2 ? 1 / std::numbers::pi : 0.5;
  if (!body.lattice()) {
    std::vector<OfPoint> points;
    FamilyArrays family;
    for (const std::int32_t p : body.owned()) {
      if (families.normaliser(static_cast<std::size_t>(p), BondWeight::volume) < 0.95 * ball_volume(body)) continue;
      families.load(static_cast<std::size_t>(p), BondsOf::uncut, family);
      energy_shares(formulation, d, family, share);
      points.push_back({body.number(static_cast<std::size_t>(p)), count(family, share, [&](std::size_t k) { return mean * family.length[k]; })});
    }
    if (const std::optional<CrossingBonds> of_all = mean_of_all(points)) return *of_all;
  }
  const FamilyArrays family = regular_family(families);
  energy_shares(formulation, d, family, share);
  if (!body.lattice()) return count(family, share, [&](std::size_t k) { return mean * family.length[k]; });
  return count(family, share, [&](std::size_t k) { return std::max(0.0, family.xi[0][k]); });
}

}  // namespace perikit
