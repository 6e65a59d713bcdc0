#include "families/family_arrays.hpp"

#include <algorithm>

#include "core/dimension.hpp"
#include "families/reproducing_kernel.hpp"
#include "families/shape_tensor.hpp"
#include "families/stencils.hpp"

namespace perikit {

void FamilyArrays::resize(int d, int n) {
  dimension = d;
  bonds = n;
  size = padded(static_cast<std::size_t>(n));
  const auto pad = [&](AlignedVector<double>& v, double rest) {
    v.resize(size);
    std::fill(v.begin() + n, v.end(), rest);
  };
  for (int c = 0; c < d; ++c) pad(xi[c], 1.0);
  pad(length, 1.0);
  pad(volume, 0.0);
  pad(omega, 0.0);
  far.resize(static_cast<std::size_t>(n));
}

FamilyView FamilyArrays::view(double horizon) const noexcept {
  return {dimension,
          bonds,
          horizon,
          {xi[0].data(), dimension > 1 ? xi[1].data() : nullptr, dimension > 2 ? xi[2].data() : nullptr},
          length.data(),
          volume.data(),
          omega.data(),
          inverse_shape,
          0};
}

void find_inverse_shape(FamilyArrays& family) {
  const int d = family.dimension;
  double K[6] = {};
  for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k)
    for (int a = 0; a < d; ++a)
      for (int e = a; e < d; ++e) K[symmetric_index(d, a, e)] += family.omega[k] * family.volume[k] * family.xi[a][k] * family.xi[e][k];
  invert_shape(d, K, family.inverse_shape);
}

int point_gradient(const FamilyArrays& family, double horizon, int order, std::vector<double>& g) {
  if (order > 1 && !family.fragment) return reproducing_kernel(family, horizon, order, g);
  g.assign(static_cast<std::size_t>(family.bonds * family.dimension), 0.0);
  with_dimension(family.dimension, [&](auto d) {
    constexpr std::size_t D = d;
    for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k) {
      double xi[D], of_bond[D];
      for (std::size_t e = 0; e < D; ++e) xi[e] = family.xi[e][k];
      point_stencil<d>(family.omega[k], family.volume[k], family.inverse_shape, xi, of_bond);
      std::copy_n(of_bond, D, &g[k * D]);
    }
  });
  return family.inverse_shape[0] != 0;
}

}  // namespace perikit
