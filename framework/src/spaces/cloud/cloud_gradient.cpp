#include "spaces/cloud/cloud_gradient.hpp"

#include <algorithm>
#include <atomic>

#include "perikit/core/parallel.hpp"

namespace perikit {

template <int D>
bool CloudGradient<D>::store_stencil(std::size_t p) {
  FamilyArrays family;
  std::vector<double> g;
  families_.load(p, BondsOf::set_up, family);
  const bool lower = point_gradient(family, families_.body().horizon(), order_, g) < order_;
  std::copy(g.begin(), g.end(), stencil_.begin() + D * lists().first[p]);
  return lower;
}

template <int D>
void CloudGradient<D>::store_stencils() {
  stencil_.assign(D * families_.bonds(), 0.0);
  std::atomic<std::size_t> lower{0};
  pieces_of(families_.body().points()).over_points([&](std::size_t p) { lower += store_stencil(p); });
  fallbacks_ = lower;
}

template class CloudGradient<1>;
template class CloudGradient<2>;
template class CloudGradient<3>;

}  // namespace perikit
