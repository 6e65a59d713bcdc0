#include "fracture/limits/crossing_bonds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "families/regular_family.hpp"
#include "perikit/core/rank_values.hpp"
#include "problem/ghosts.hpp"

namespace perikit {

namespace {

/// length(k): xi.n of bond k on the average over what is counted, 0 where it does not cross.
template <class Length>
CrossingBonds count(const FamilyArrays& family, const AlignedVector<double>& share, const Length& length) {
  CrossingBonds crossing;
  for (std::size_t k = 0; k < family.far.size(); ++k) {
    crossing.plain += family.volume[k] * length(k);
    crossing.shares += share[k] * family.volume[k] * length(k);
    crossing.of_family += share[k] * family.volume[k];
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
    sum.of_family += point.crossing.of_family;
  }
  const auto points = static_cast<double>(all.size());
  const std::vector<CrossingBonds> mean = told_to_all(all.empty() ? std::vector<CrossingBonds>() : std::vector{CrossingBonds{sum.plain / points, sum.shares / points, sum.of_family / points}});
  if (mean.empty()) return std::nullopt;
  return mean.front();
}

/// Whether a family has points on all sides: along the axes and their diagonals it reaches to within 1.3 spacings of the horizon. Unlike the volume of
/// a family, that does not ask for more neighbours than points of an irregular cloud have on the mean.
bool has_all_sides(const Body& body, const FamilyArrays& family) {
  const int d = body.dimension(), y_reach = d > 1, z_reach = d > 2;
  const double least = body.horizon() - 1.3 * body.spacing();
  for (int z = -z_reach; z <= z_reach; ++z)
    for (int y = -y_reach; y <= y_reach; ++y)
      for (int x = -1; x <= 1; ++x) {
        const int direction[] = {x, y, z};
        const double length = std::sqrt(static_cast<double>(x * x + y * y + z * z));
        if (length == 0) continue;
        const auto reaches = [&](std::size_t k) {
          double along = 0;
          for (int a = 0; a < d; ++a) along += family.xi[a][k] * direction[a];
          return along >= least * length;
        };
        bool reached = false;
        for (std::size_t k = 0; k < family.far.size() && !reached; ++k) reached = reaches(k);
        if (!reached) return false;
      }
  return true;
}

}  // namespace

double half_mean_cosine(int dimension) noexcept { return dimension == 3 ? 0.25 : dimension == 2 ? 1 / std::numbers::pi : 0.5; }

CrossingBonds crossing_bonds(const Families& families, const EnergyShares& energy_shares, const Partition* partition, const ImageMap* images) {
  const Body& body = families.body();
  const int d = body.dimension();
  AlignedVector<double> share;
  const double mean = half_mean_cosine(d);
  if (!body.lattice()) {
    FamilyArrays family;
    Field all_sides = body.make_field(1);
    for (const std::int32_t p : body.owned()) {
      families.load(static_cast<std::size_t>(p), BondsOf::uncut, family);
      all_sides.data()[p] = has_all_sides(body, family) ? 1 : 0;
    }
    if (partition) Ghosts(*partition, 1).forward(all_sides);
    if (images) images->copy_from_sources(all_sides);
    // No surface cuts the family of a point of whose neighbours each has points on all sides; thin bodies have no such point.
    std::vector<OfPoint> whole, others;
    for (const std::int32_t p : body.owned()) {
      if (all_sides.data()[p] == 0) continue;
      families.load(static_cast<std::size_t>(p), BondsOf::uncut, family);
      energy_shares.of_point(static_cast<std::size_t>(p), family, share);
      const bool is_whole = std::ranges::all_of(family.far, [&](std::int32_t far) { return all_sides.data()[far] != 0; });
      (is_whole ? whole : others).push_back({body.number(static_cast<std::size_t>(p)), count(family, share, [&](std::size_t k) { return mean * family.length[k]; })});
    }
    for (const std::vector<OfPoint>& points : {whole, others})
      if (const std::optional<CrossingBonds> of_all = mean_of_all(points)) return *of_all;
  }
  const FamilyArrays family = regular_family(families);
  energy_shares.of_regular(family, share);
  if (!body.lattice()) return count(family, share, [&](std::size_t k) { return mean * family.length[k]; });
  return count(family, share, [&](std::size_t k) { return std::max(0.0, family.xi[0][k]); });
}

}  // namespace perikit
