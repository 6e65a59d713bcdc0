#include "terms/pairs/surface_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "families/regular_family.hpp"
#include "terms/family_point.hpp"

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

double weighted_volume(const FamilyArrays& family, bool whole) {
  double m = 0;
  for (std::size_t k = 0; k < family.far.size(); ++k)
    m += (whole ? family.whole_omega(k) : family.omega[k]) * family.length[k] * family.length[k] * family.volume[k];
  return m;
}

template <int D>
Field surface_correction(const Families& families, const PairKinematics& law, const Laws& laws) {
  const Body& body = families.body();
  Field correction = body.make_field(D);
  const FamilyArrays regular = regular_family(families);
  FamilyArrays family;
  // Pre-cracks weaken a body on purpose: the correction is that of the uncut family.
  families.each_class([&](std::span<const std::int32_t> points) {
    families.load(static_cast<std::size_t>(points[0]), BondsOf::uncut, family);
    const auto stiffness = [&](const FamilyArrays& of, PairPoint x) {
      x.weighted_volume = weighted_volume(of, true);
      return axial_stiffness<D>(law, law.moduli(x).bond, of);
    };
    std::array<double, D> G;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = static_cast<std::size_t>(points[k]);
      if (k == 0 || !laws.single()) {
        G.fill(1.0);
        if (!family.far.empty()) {
          PairPoint x{family_point(body, laws, p), 0, 1};
          if (!(x.bulk() > 0)) x.moduli = {1, 1};   // ghosts: the correction is one of shape
          const auto own = stiffness(family, x), exact = stiffness(regular, x);
          for (std::size_t a = 0; a < D; ++a)
            if (own[a] > 0) G[a] = exact[a] / own[a];
        }
      }
      for (int a = 0; a < D; ++a) correction.component(a)[p] = G[static_cast<std::size_t>(a)];
    }
  });
  return correction;
}

template Field surface_correction<1>(const Families&, const PairKinematics&, const Laws&);
template Field surface_correction<2>(const Families&, const PairKinematics&, const Laws&);
template Field surface_correction<3>(const Families&, const PairKinematics&, const Laws&);

}  // namespace perikit
