/// Moment factors on a cloud: multipliers for each point, of third moments too where nothing is missing around it.

#include <algorithm>
#include <cmath>

#include "cloud_balance/points_with_full_neighbourhood.hpp"
#include "families/cloud/cloud_families.hpp"
#include "terms/pairs/moment_points.hpp"

namespace perikit {

namespace {

/// Of the directions from one point to others.
template <int D>
struct Directions {
  const Row* rows;
  double horizon;
  void operator()(std::size_t p, std::int64_t /*bond*/, const std::int32_t* far, Pack (&phi)[even_moments<D>], Pack (&psi)[odd_moments<D>]) const noexcept {
    const RowColumns x = RowColumns::load(rows, far);
    Pack n[D], square(0.0);
    for (int c = 0; c < D; ++c) {
      n[c] = x[c] - Pack(rows[p][c]);
      square += n[c] * n[c];
    }
    const Pack inverse = Pack(1.0) / sqrt(square), rho = Pack(0.5 * horizon) * inverse;
    for (Pack& component : n) component *= inverse;
    even_polynomials<D>(n, phi);
    odd_polynomials<D>(n, psi);
    for (Pack& polynomial : psi) polynomial *= rho;
  }
};

}  // namespace

template <int D>
void cloud_factors(const Families& families, const PairKinematics& law, const MomentTarget& target, const PointCopies& copies, BondFactors& out) {
  const Body& body = families.body();
  const FamilyLists& lists = families.cloud()->lists();
  AlignedVector<double> weights(lists.neighbour.size() + padding, 0.0);
  out.by_bond.assign(lists.neighbour.size() + padding, 1.0);
  MomentBonds bonds;
  FamilyArrays family;
  AlignedVector<double> weight, omega;
  for (const std::int32_t i : body.owned()) {
    const auto p = static_cast<std::size_t>(i);
    families.load(p, BondsOf::set_up, family);
    if (family.bonds == 0) continue;
    bonds.points.push_back(i);
    bonds.begin.push_back(lists.first[p]);
    bonds.end.push_back(lists.first[p + 1]);
    weight.assign(family.size, 0.0);
    omega.assign(family.size, 0.0);
    for (std::size_t k = 0; k < family.far.size(); ++k) omega[k] = family.whole_omega(k);
    moment_weights(law, out.of_dilatation, family.bonds, family.length.data(), omega.data(), weight.data());
    for (std::size_t k = 0; k < family.far.size(); ++k)
      weights[static_cast<std::size_t>(lists.first[p]) + k] = family.volume[k] * weight[k] / target.trace;
  }
  bonds.inside.assign(body.stride(), 0);
  for (const std::int32_t p : find_closed_points(families, copies.copy).whole) bonds.inside[static_cast<std::size_t>(p)] = 1;
  bonds.far = lists.neighbour.data();
  bonds.weight = weights.data();
  bonds.factor = out.by_bond.data();
  const Directions<D> directions{reinterpret_cast<const Row*>(body.rows().data()), body.horizon()};
  MomentPoints<D, true, Directions<D>> points(body, bonds, copies, directions);
  points.find();
  out.iterations = points.iterations();
  // Of all bonds of this rank's lists, those of ghosts and images too.
  parallel_for(body.internal().size(), [&](std::size_t k) {
    const auto p = static_cast<std::size_t>(body.internal()[k]);
    std::int32_t far[pack_width];
    for (std::int64_t b = lists.first[p]; b < lists.first[p + 1]; b += pack_width) {
      const int n = static_cast<int>(std::min<std::int64_t>(pack_width, lists.first[p + 1] - b));
      std::copy_n(lists.neighbour.begin() + b, n, far);
      std::fill(far + n, far + pack_width, far[0]);
      points.factors(p, b, far).store_first(out.by_bond.data() + b, n);
    }
  });
  FactorsFound found;
  for (const std::int32_t i : bonds.points) {
    const auto p = static_cast<std::size_t>(i);
    found.add(i, points.error(p));
    for (std::int64_t b = lists.first[p]; b < lists.first[p + 1]; ++b) found.add(out.by_bond[static_cast<std::size_t>(b)]);
  }
  judge_factors(body, found, out);
}
template void cloud_factors<1>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);
template void cloud_factors<2>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);
template void cloud_factors<3>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);

}  // namespace perikit
