#include "spaces/local_force_point.hpp"

#include <algorithm>

#include "families/shape_tensor.hpp"

namespace perikit {

namespace {

/// g_k = omega V_k K^-1 xi_k of these weights; false, and g untouched, where K is ill conditioned.
template <int D>
bool stencil(const FamilyArrays& f, const double* omega, double* g) {
  double K[6] = {}, inverse[6], condition = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(f.bonds); ++k)
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) K[symmetric_index(D, a, b)] += omega[k] * f.volume[k] * f.xi[a][k] * f.xi[b][k];
  if (!invert_shape(D, K, inverse, &condition) || !(condition * poor_ratio < 1)) return false;
  for (std::size_t k = 0; k < static_cast<std::size_t>(f.bonds); ++k)
    for (int e = 0; e < D; ++e) {
      double sum = 0;
      for (int a = 0; a < D; ++a) sum += inverse[symmetric_index(D, a, e)] * f.xi[a][k];
      g[k * D + static_cast<std::size_t>(e)] = omega[k] * f.volume[k] * sum;
    }
  return true;
}

}  // namespace

template <int D>
void LocalForcePoint<D>::build(const WeightedKinematics& kinematics, const PointFamilies& families, std::size_t row, double family_volume) {
  families.load(row, family);
  families.bond_shares(row, family, share);
  point_gradient(family, families.body().horizon(), 1, own);
  const auto bonds = static_cast<std::size_t>(family.bonds);
  const FamilyView view = family.view(families.body().horizon());
  domain.assign(bonds * bonds * D, 0.0);
  scale.assign(bonds, 0.0);
  omega_.resize(bonds * family.size);
  kinematics.weights(view, omega_.data(), family.size);
  for (std::size_t q = 0; q < bonds; ++q) {
    const double* const omega = omega_.data() + q * family.size;
    double* const g = domain.data() + q * bonds * D;
    const bool regular = stencil<D>(family, omega, g);
    if (!regular) std::copy(own.begin(), own.end(), g);
    double volume = 0;
    for (std::size_t k = 0; k < bonds; ++k) {
      if (family.omega[k] > 0) volume += (regular ? omega[k] / family.omega[k] : 1.0) * family.volume[k];
    }
    scale[q] = share[q] > 0 ? volume / family_volume / share[q] : 0.0;
  }
}

template struct LocalForcePoint<1>;
template struct LocalForcePoint<2>;
template struct LocalForcePoint<3>;

}  // namespace perikit
