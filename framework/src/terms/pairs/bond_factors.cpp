#include "terms/pairs/bond_factors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/dimension.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/regular_family.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"
#include "terms/family_point.hpp"
#include "terms/pairs/moment_factors.hpp"

namespace perikit {

double weighted_volume(const FamilyArrays& family, bool whole) {
  double m = 0;
  for (std::size_t k = 0; k < family.far.size(); ++k)
    m += (whole ? family.whole_omega(k) : family.omega[k]) * family.length[k] * family.length[k] * family.volume[k];
  return m;
}

double BondFactors::of(const Families& families, std::size_t p, std::size_t far) const {
  if (!tables.empty()) {
    const std::size_t slot = families.lattice()->slots.with_shift(static_cast<std::int64_t>(far) - static_cast<std::int64_t>(p));
    return tables[static_cast<std::size_t>(table_of[p / padding])][slot * padding + p % padding];
  }
  if (by_bond.empty()) return 1;
  const FamilyLists& lists = families.cloud()->lists();
  const std::int64_t bond = families.cloud()->index(static_cast<std::int32_t>(p), static_cast<std::int32_t>(far));
  const bool there = bond < lists.first[p + 1] && lists.neighbour[static_cast<std::size_t>(bond)] == static_cast<std::int32_t>(far);
  return there ? by_bond[static_cast<std::size_t>(bond)] : 1.0;
}

std::size_t BondFactors::bytes() const noexcept {
  std::size_t sum = by_bond.size() * sizeof(double) + table_of.size() * sizeof(std::int32_t);
  for (const AlignedVector<double>& table : tables) sum += table.size() * sizeof(double);
  return sum;
}

double BondFactors::weighted_volume(const Families& families, std::size_t p, const FamilyArrays& family) const {
  double m = 0;
  for (std::size_t k = 0; k < family.far.size(); ++k) {
    if (family.omega[k] == 0) continue;   // a bond that a pre-crack cuts has no factor
    const double f = of_dilatation ? of(families, p, static_cast<std::size_t>(family.far[k])) : 1.0;
    m += f * family.omega[k] * family.length[k] * family.length[k] * family.volume[k];
  }
  return m;
}

void BondFactors::report(ModelReport& report) const {
  report.bytes += bytes();
  if (points == 0) return;
  report.notes.emplace_back("bond factors", fmt::format("{:.3g} to {:.3g}; of {} points {} have the moments of the material, {} are off by more than 1 %, at most {:.2g} at ({:.6g}, {:.6g}, {:.6g}); {} products, {:.2g} s",
                                                         smallest, largest, points, points - off, far_off, worst, where[0], where[1], where[2], iterations, seconds));
}

void moment_weights(const PairKinematics& law, bool dilates, int n, const double* length, const double* omega, double* weight) {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  if (dilates) {
    for (int k = 0; k < lanes; ++k) weight[k] = omega[k] * length[k] * length[k];
    return;
  }
  alignas(64) double rest[batch_points] = {}, modulus[batch_points];
  std::fill(std::begin(modulus), std::end(modulus), 1.0);
  for (int first = 0; first < n; first += batch_points) {
    const int count = std::min(batch_points, n - first);
    law.bond_law({count, length + first, omega + first, rest, modulus, nullptr, nullptr, weight + first});
  }
  for (int k = 0; k < n; ++k) weight[k] *= length[k] * length[k];
  std::fill(weight + n, weight + lanes, 0.0);
}

void judge_factors(const Body& body, const FactorsFound& found, BondFactors& out) {
  std::int64_t counts[3] = {found.points, found.off, found.far_off};
  communicator().sum(counts);
  out.points = counts[0];
  out.off = counts[1];
  out.far_off = counts[2];
  out.smallest = -communicator().largest(-found.smallest);
  out.largest = communicator().largest(found.largest);
  out.worst = communicator().largest(found.worst);
  // Of several points with this error the first one.
  constexpr double none = std::numeric_limits<double>::infinity();
  const auto at = static_cast<std::size_t>(found.where);
  const double number = found.where >= 0 && found.worst == out.worst ? static_cast<double>(body.number(at)) : none;
  const double first = -communicator().largest(-number);
  const Point x = number == first && number < none ? body.position(at) : Point{};
  for (std::size_t a = 0; a < 3; ++a) out.where[a] = communicator().largest(std::max(x[a], 0.0)) - communicator().largest(std::max(-x[a], 0.0));
}

template <int D>
BondFactors moment_factors(const Families& families, const PairKinematics& law, const PointCopies& copies) {
  const auto begin = std::chrono::steady_clock::now();
  const Body& body = families.body();
  const FamilyArrays regular = regular_family(families);
  BondFactors factors;
  factors.of_dilatation = law.dilatation() != nullptr;
  MomentTarget target;
  AlignedVector<double> weight(regular.size, 0.0);
  moment_weights(law, factors.of_dilatation, regular.bonds, regular.length.data(), regular.omega.data(), weight.data());
  target.weight.assign(weight.begin(), weight.begin() + regular.bonds);
  const double m = perikit::weighted_volume(regular, true);
  if (factors.of_dilatation) {
    target.trace = m;
  } else {
    // Springs in a body of bulk modulus K store mu (tr^2 + 2 eps : eps)/2 with mu = d K/(d + 2), and c/4 sum_j V_j w_ij (n . eps n)^2 of it: t = 2 d^2 K/c.
    PairPoint point{{body.space(), body.section(), body.horizon(), {1, 1}}, m, 1};
    target.trace = 2 * D * D * point.bulk() / law.moduli(point).bond;
  }
  if (families.lattice()) lattice_factors<D>(families, target, copies, factors);
  else cloud_factors<D>(families, law, target, copies, factors);
  factors.seconds = communicator().largest(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return factors;
}

std::shared_ptr<const BondFactors> find_bond_factors(const Formulation& formulation, const Families& families, const Laws& laws, const PointCopies& copies) {
  if (!formulation.pairs || formulation.pair_traits.factors == BondFactorsOf::none) return std::make_shared<const BondFactors>();
  return with_dimension(families.body().dimension(), [&](auto d) {
    const PairKinematics& law = *formulation.pairs;
    return std::make_shared<const BondFactors>(formulation.pair_traits.factors == BondFactorsOf::energy ? energy_factors<d>(families, law, laws) : moment_factors<d>(families, law, copies));
  });
}

template BondFactors moment_factors<1>(const Families&, const PairKinematics&, const PointCopies&);
template BondFactors moment_factors<2>(const Families&, const PairKinematics&, const PointCopies&);
template BondFactors moment_factors<3>(const Families&, const PairKinematics&, const PointCopies&);

}  // namespace perikit
