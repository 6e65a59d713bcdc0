#include "problem/surroundings/image_gradients.hpp"

#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

void continue_gradients(const Families& families, const ImageMap& images, ConstFieldView u, FieldView H) {
  images.mirror_gradients(H);
  const std::span<const std::int32_t> held = images.held();
  const int d = families.body().dimension();
  parallel_for(held.size(), [&](std::size_t n) {
    const std::int32_t p = held[n];
    FamilyArrays family;
    families.load(static_cast<std::size_t>(p), BondsOf::intact, family);
    std::vector<double> g;
    if (!families.needs().shapes) find_inverse_shape(family);
    point_gradient(family, families.body().horizon(), 1, g);
    for (int c = 0; c < d; ++c)
      for (int e = 0; e < d; ++e) {
        double gradient = 0;
        for (std::size_t k = 0; k < family.far.size(); ++k)
          gradient += (u.component(c)[family.far[k]] - u.component(c)[p]) * g[k * static_cast<std::size_t>(d) + static_cast<std::size_t>(e)];
        H.component(c * d + e)[p] = gradient;
      }
  });
}

}  // namespace perikit
