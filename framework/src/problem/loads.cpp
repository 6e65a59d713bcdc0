#include "perikit/problem/loads.hpp"

#include <algorithm>
#include <array>

namespace perikit {

Loads::Loads(const Body& body, std::vector<Load> loads, std::vector<FollowingPressure> pressures, const ImageMap* images)
    : body_(&body), loads_(std::move(loads)), pressures_(std::move(pressures)), images_(images) {}

bool Loads::depend_on_time() const noexcept {
  return follow() || std::ranges::any_of(loads_, [](const Load& load) {
           return std::ranges::any_of(load.components, [](const Load::Component& c) { return c.value.varies(); });
         });
}

void Loads::evaluate(double t, FieldView force, const Field* H) const {
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
  if (H) add_pressures(t, *H, force);
  if (images_) images_->fold(force);
}

void Loads::add_pressures(double t, const Field& H, FieldView force) const {
  const auto d = static_cast<std::size_t>(body_->dimension());
  for (const FollowingPressure& pressure : pressures_)
    for (std::size_t k = 0; k < pressure.points.size(); ++k) {
      const std::int32_t p = pressure.points[k];
      const double value = pressure.value(body_->position(static_cast<std::size_t>(p)), t);
      // H holds the in-space components row by row, then the other diagonal ones.
      std::array<std::array<double, 3>, 3> F{};
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < d && a < d; ++b) F[a][b] = H.component(static_cast<int>(a * d + b))[p];
        if (a >= d) F[a][a] = H.component(static_cast<int>(d * d + a - d))[p];
        F[a][a] += 1;
      }
      for (std::size_t a = 0; a < d; ++a) {
        const std::size_t a1 = (a + 1) % 3, a2 = (a + 2) % 3;
        double area = 0;  // (cof F area)_a
        for (std::size_t b = 0; b < d; ++b) {
          const std::size_t b1 = (b + 1) % 3, b2 = (b + 2) % 3;
          area += (F[a1][b1] * F[a2][b2] - F[a1][b2] * F[a2][b1]) * pressure.area[k][b];
        }
        force.component(static_cast<int>(a))[p] -= value * area;
      }
    }
}

}  // namespace perikit
