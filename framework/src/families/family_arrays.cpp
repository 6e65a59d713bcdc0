#include "families/family_arrays.hpp"

#include <algorithm>

#include "families/reproducing_kernel.hpp"
#include "families/shape_tensor.hpp"

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

int point_gradient(const FamilyArrays& family, double horizon, int order, std::vector<double>& g) {
  if (order > 1 && !family.fragment) return reproducing_kernel(family, horizon, order, g);
  const int d = family.dimension;
  g.assign(static_cast<std::size_t>(family.bonds * d), 0.0);
  for (int k = 0; k < family.bonds; ++k)
    for (int e = 0; e < d; ++e)
      for (int a = 0; a < d; ++a) {
        const auto bond = static_cast<std::size_t>(k);
        g[static_cast<std::size_t>(k * d + e)] +=
            family.omega[bond] * family.volume[bond] * family.inverse_shape[symmetric_index(d, a, e)] * family.xi[a][bond];
      }
  return family.inverse_shape[0] != 0;
}

}  // namespace perikit
