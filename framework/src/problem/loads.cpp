#include "perikit/problem/loads.hpp"

#include <algorithm>

namespace perikit {

Loads::Loads(const Body& body, std::vector<Load> loads, const ImageMap* images) : body_(&body), loads_(std::move(loads)), images_(images) {}

bool Loads::depend_on_time() const noexcept {
  return std::ranges::any_of(loads_, [](const Load& load) {
    return std::ranges::any_of(load.components, [](const Load::Component& c) { return c.value.varies(); });
  });
}

void Loads::evaluate(double t, FieldView force) const {
  std::fill_n(force.data, force.size(), 0.0);
  for (const Load& load : loads_)
    for (const Load::Component& component : load.components) {
      double* f = force.component(component.component);
      const bool everywhere = !component.value.depends_on_position;
      const double common = everywhere ? component.value({}, t) : 0.0;
      for (std::size_t k = 0; k < load.points.size(); ++k) {
        const std::int32_t p = load.points[k];
        f[p] += load.share[k] * (everywhere ? common : component.value(body_->position(static_cast<std::size_t>(p)), t));
      }
    }
  if (images_) images_->fold(force);
}

}  // namespace perikit
