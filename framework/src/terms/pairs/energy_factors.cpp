/// Factors that correct the energy of a homogeneous stretch along each axis near surfaces.

#include <algorithm>
#include <array>
#include <cmath>

#include "families/cloud/cloud_families.hpp"
#include "families/regular_family.hpp"
#include "terms/family_point.hpp"
#include "terms/pairs/bond_factors.hpp"
#include "terms/pairs/lattice_tables.hpp"

namespace perikit {

namespace {

/// Stiffness of the whole bonds of a family against a homogeneous stretch along each axis: 1/2 sum_j V_j w''(0) (|xi| cos^2)^2.
template <int D>
std::array<double, D> axial_stiffness(const PairKinematics& law, double modulus, const FamilyArrays& family) {
  const std::size_t n = family.size;
  AlignedVector<double> omega(n, 0.0), rest(n, 0.0), moduli(n, modulus), stiffness(n, 0.0);
  for (std::size_t k = 0; k < family.far.size(); ++k) omega[k] = family.whole_omega(k);
  law.bond_law({family.bonds, family.length.data(), omega.data(), rest.data(), moduli.data(), nullptr, nullptr, stiffness.data()});
  std::array<double, D> sum{};
  for (std::size_t k = 0; k < family.far.size(); ++k)
    for (std::size_t a = 0; a < D; ++a) {
      const double extension = family.xi[a][k] * family.xi[a][k] / family.length[k];
      sum[a] += 0.5 * family.volume[k] * stiffness[k] * extension * extension;
    }
  return sum;
}

}  // namespace

template <int D>
BondFactors energy_factors(const Families& families, const PairKinematics& law, const Laws& laws) {
  const Body& body = families.body();
  Field G = body.make_field(D);
  const FamilyArrays regular = regular_family(families);
  FamilyArrays family;
  // Pre-cracks weaken a body on purpose: the correction is that of the uncut family.
  families.each_class([&](std::span<const std::int32_t> points) {
    families.load(static_cast<std::size_t>(points[0]), BondsOf::uncut, family);
    const auto stiffness = [&](const FamilyArrays& of, PairPoint x) {
      x.weighted_volume = weighted_volume(of, true);
      return axial_stiffness<D>(law, law.moduli(x).bond, of);
    };
    std::array<double, D> ratio;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = static_cast<std::size_t>(points[k]);
      if (k == 0 || !laws.single()) {
        ratio.fill(1.0);
        if (!family.far.empty()) {
          PairPoint x{family_point(body, laws, p), 0, 1};
          if (!(x.bulk() > 0)) x.moduli = {1, 1};   // ghosts: the correction is one of shape
          const auto own = stiffness(family, x), exact = stiffness(regular, x);
          for (std::size_t a = 0; a < D; ++a)
            if (own[a] > 0) ratio[a] = exact[a] / own[a];
        }
      }
      for (int a = 0; a < D; ++a) G.component(a)[p] = ratio[static_cast<std::size_t>(a)];
    }
  });
  const auto factor = [&](std::size_t p, std::size_t q, const double* xi, double length) {
    // Exactly one between two points of whole families, wherever their chunk ends: tables leave those out.
    double sum = 1;
    for (int a = 0; a < D; ++a) {
      const double cosine = xi[a] / length;
      sum += 0.5 * cosine * cosine * ((G.component(a)[p] - 1) + (G.component(a)[q] - 1));
    }
    return sum;
  };
  BondFactors factors;
  if (const LatticeFamilies* const lattice = families.lattice()) {
    const auto& xi = lattice->slots.xi;
    const auto usual = [&](std::size_t p) {
      for (int a = 0; a < D; ++a)
        if (G.component(a)[p] != 1) return false;
      return true;
    };
    make_tables(*lattice, std::vector<double>(lattice->slots.size(), 1.0), [&](const LatticeChunk& chunk) {
      for (auto p = static_cast<std::size_t>(chunk.first), l = std::size_t{0}; l < chunk_points; ++l, ++p) {
        if (!usual(p)) return false;
        for (const std::int64_t shift : lattice->slots.shifts)
          if (!usual(static_cast<std::size_t>(static_cast<std::int64_t>(p) + shift))) return false;
      }
      return true;
    }, [&](std::size_t p, std::size_t slot, std::size_t q) { return factor(p, q, xi[slot].data(), std::sqrt(xi[slot][0] * xi[slot][0] + xi[slot][1] * xi[slot][1] + xi[slot][2] * xi[slot][2])); }, factors);
    return factors;
  }
  const FamilyLists& lists = families.cloud()->lists();
  const std::span<const double> rows = body.rows();
  factors.by_bond.assign(lists.neighbour.size(), 1.0);
  for (const std::int32_t i : body.internal()) {
    const auto p = static_cast<std::size_t>(i);
    for (std::int64_t b = lists.first[p]; b < lists.first[p + 1]; ++b) {
      const auto q = static_cast<std::size_t>(lists.neighbour[static_cast<std::size_t>(b)]);
      double xi[3], square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        xi[c] = rows[4 * q + c] - rows[4 * p + c];
        square += xi[c] * xi[c];
      }
      factors.by_bond[static_cast<std::size_t>(b)] = factor(p, q, xi, std::sqrt(square));
    }
  }
  return factors;
}

template BondFactors energy_factors<1>(const Families&, const PairKinematics&, const Laws&);
template BondFactors energy_factors<2>(const Families&, const PairKinematics&, const Laws&);
template BondFactors energy_factors<3>(const Families&, const PairKinematics&, const Laws&);

}  // namespace perikit
