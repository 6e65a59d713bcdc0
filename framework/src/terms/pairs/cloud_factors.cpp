/// Moment factors on a cloud: multipliers for each point, of third moments too where nothing is missing around it.

#include <algorithm>
#include <cmath>

#include "cloud_balance/points_with_full_neighbourhood.hpp"
#include "families/cloud/cloud_families.hpp"
#include "terms/pairs/moment_points.hpp"

namespace perikit {

namespace {

constexpr double most_bonds_in_doubles = 2e6;

/// Of the directions from one point to others.
template <int D>
class Directions {
 public:
  explicit Directions(const Body& body) : rows_(reinterpret_cast<const Row*>(body.rows().data())), horizon_(body.horizon()), unit_(power_of_two(horizon_)) {
    // Singles are a multiple of a step and what is left of it: differences of the former are exact.
    double most = 0;
    for (const std::int32_t p : body.internal())
      for (int c = 0; c < D; ++c) most = std::max(most, std::abs(rows_[p][c]));
    const double step = std::ldexp(power_of_two(communicator().largest(most) / unit_), -22);
    split_.assign(body.stride() * parts, FourSingles{});
    parallel_for(body.stride(), [&](std::size_t p) {
      for (int c = 0; c < D; ++c) {
        const double x = rows_[p][c] / unit_, coarse = step * std::round(x / step);
        float* const own = reinterpret_cast<float*>(&split_[p * parts]);
        own[c] = static_cast<float>(coarse);
        own[c + 2 * static_cast<int>(parts)] = static_cast<float>(x - coarse);
      }
    });
  }
  void operator()(std::size_t p, std::int64_t /*bond*/, const std::int32_t* far, Pack (&phi)[even_moments<D>], Pack (&psi)[odd_moments<D>]) const noexcept {
    const RowColumns x = RowColumns::load(rows_, far);
    Pack n[D];
    for (int c = 0; c < D; ++c) n[c] = x[c] - Pack(rows_[p][c]);
    polynomials(n, horizon_, phi, psi);
  }
  void operator()(std::size_t p, std::int64_t /*bond*/, const std::int32_t* far, SinglePack (&phi)[even_moments<D>], SinglePack (&psi)[odd_moments<D>]) const noexcept {
    SinglePack x[4 * parts], n[D];
    for (std::size_t part = 0; part < parts; ++part) load_columns(split_.data() + part, far, parts, *reinterpret_cast<SinglePack(*)[4]>(x + 4 * part));
    const float* const own = reinterpret_cast<const float*>(&split_[p * parts]);
    constexpr int fine = 2 * static_cast<int>(parts);
    for (int c = 0; c < D; ++c) n[c] = (x[c] - SinglePack(own[c])) + (x[c + fine] - SinglePack(own[c + fine]));
    polynomials(n, horizon_ / unit_, phi, psi);
  }

 private:
  static constexpr std::size_t parts = D < 3 ? 1 : 2;

  template <class P>
  static void polynomials(P (&n)[D], double horizon, P (&phi)[even_moments<D>], P (&psi)[odd_moments<D>]) noexcept {
    P square(std::is_same_v<P, Pack> ? 0.0 : 1e-30);   // packs of singles may hold a point itself where there is no bond
    for (int c = 0; c < D; ++c) square += n[c] * n[c];
    const P inverse = P(1.0) / sqrt(square), rho = P(0.5 * horizon) * inverse;
    for (P& component : n) component *= inverse;
    even_polynomials<D>(n, phi);
    odd_polynomials<D>(n, psi);
    for (P& polynomial : psi) polynomial *= rho;
  }

  const Row* rows_;
  double horizon_, unit_;
  AlignedVector<FourSingles> split_;
};

}  // namespace

template <int D>
void cloud_factors(const Families& families, const PairKinematics& law, const MomentTarget& target, const PointCopies& copies, BondFactors& out) {
  const Body& body = families.body();
  const FamilyLists& lists = families.cloud()->lists();
  AlignedVector<double> weights(lists.neighbour.size() + padding, 0.0);
  out.by_bond.assign(lists.neighbour.size() + padding, 1.0);
  MomentBonds bonds;
  for (const std::int32_t i : body.owned()) {
    const auto p = static_cast<std::size_t>(i);
    if (lists.first[p] == lists.first[p + 1]) continue;
    bonds.points.push_back(i);
    bonds.begin.push_back(lists.first[p]);
    bonds.end.push_back(lists.first[p + 1]);
  }
  over_blocks(bonds.points.size(), [&](std::size_t first, std::size_t last) {
    FamilyArrays family;
    AlignedVector<double> weight, omega;
    for (std::size_t i = first; i < last; ++i) {
      const auto begin = static_cast<std::size_t>(bonds.begin[i]);
      families.load(static_cast<std::size_t>(bonds.points[i]), BondsOf::set_up, family);
      weight.assign(family.size, 0.0);
      omega.assign(family.size, 0.0);
      for (std::size_t k = 0; k < family.far.size(); ++k) omega[k] = family.whole_omega(k);
      moment_weights(law, out.of_dilatation, family.bonds, family.length.data(), omega.data(), weight.data());
      for (std::size_t k = 0; k < family.far.size(); ++k) weights[begin + k] = family.volume[k] * weight[k] / target.trace;
    }
  });
  bonds.inside.assign(body.stride(), 0);
  for (const std::int32_t p : find_closed_points(families, copies.copy).whole) bonds.inside[static_cast<std::size_t>(p)] = 1;
  bonds.far = lists.neighbour.data();
  bonds.weight = weights.data();
  FactorsFound found;
  const auto find = [&](auto&& points) {
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
    for (const std::int32_t i : bonds.points) {
      const auto p = static_cast<std::size_t>(i);
      found.add(i, points.error(p));
      for (std::int64_t b = lists.first[p]; b < lists.first[p + 1]; ++b) found.add(out.by_bond[static_cast<std::size_t>(b)]);
    }
  };
  // Steps in single precision take half of the time, and differ in the seventh digit with the order of the points. Counted so that a part of a body that is set up alone has the arrays that it has among others.
  const double count = static_cast<double>(target.weight.size()) * static_cast<double>(body.points_of_all_ranks());
  if (count > most_bonds_in_doubles) find(MomentPoints<D, true, Directions<D>, SinglePack>(body, bonds, copies, Directions<D>(body)));
  else find(MomentPoints<D, true, Directions<D>, Pack>(body, bonds, copies, Directions<D>(body)));
  judge_factors(body, found, out);
}
template void cloud_factors<1>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);
template void cloud_factors<2>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);
template void cloud_factors<3>(const Families&, const PairKinematics&, const MomentTarget&, const PointCopies&, BondFactors&);

}  // namespace perikit
