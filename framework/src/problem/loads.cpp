#include "perikit/problem/loads.hpp"

#include <algorithm>
#include <array>

namespace perikit {

namespace {

/// p times the area vector of each point of a pressure.
std::vector<Point> reference_forces(const Pressure& pressure, const Body& body, double t) {
  std::vector<Point> forces = pressure.area;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!pressure.rules[a]) {
      for (std::size_t k = 0; k < forces.size(); ++k)
        if (forces[k][a] != 0) forces[k][a] *= pressure.value(body.position(static_cast<std::size_t>(pressure.points[k])), t);
      continue;
    }
    const std::vector<double> component = pressure.rules[a]->forces(pressure.value, t);
    for (std::size_t k = 0; k < forces.size(); ++k) forces[k][a] = component[k];
  }
  return forces;
}

}  // namespace

Loads::Loads(const Body& body, std::vector<Load> loads, std::vector<Pressure> pressures, const ImageMap* images)
    : body_(&body), loads_(std::move(loads)), pressures_(std::move(pressures)), images_(images) {}

bool Loads::follow() const noexcept {
  return std::ranges::any_of(pressures_, &Pressure::follows);
}

bool Loads::depend_on_time() const noexcept {
  return follow() || std::ranges::any_of(pressures_, [](const Pressure& pressure) { return pressure.value.varies(); }) ||
         std::ranges::any_of(loads_, [](const Load& load) {
           return std::ranges::any_of(load.components, [](const Load::Component& c) { return c.value.varies(); });
         });
}

void Loads::evaluate(double t, FieldView force, const Field* H) const {
  std::fill_n(force.data, force.size(), 0.0);
  for (const Load& load : loads_)
    for (const Load::Component& component : load.components) {
      double* f = force.component(component.component);
      if (load.rule) {
        const std::vector<double> forces = load.rule->forces(component.value, t);
        for (std::size_t k = 0; k < load.points.size(); ++k) f[load.points[k]] += forces[k];
        continue;
      }
      const bool everywhere = !component.value.depends_on_position;
      const double common = everywhere ? component.value({}, t) : 0.0;
      for (std::size_t k = 0; k < load.points.size(); ++k) {
        const std::int32_t p = load.points[k];
        f[p] += load.share[k] * (everywhere ? common : component.value(body_->position(static_cast<std::size_t>(p)), t));
      }
    }
  for (const Pressure& pressure : pressures_) {
    if (pressure.follows && !H) continue;
    const std::vector<Point> reference = reference_forces(pressure, *body_, t);
    if (pressure.follows) {
      add_following(pressure, reference, *H, force);
      continue;
    }
    for (std::size_t k = 0; k < pressure.points.size(); ++k)
      for (int a = 0; a < body_->dimension(); ++a) force.component(a)[pressure.points[k]] -= reference[k][static_cast<std::size_t>(a)];
  }
  if (images_) images_->fold(force);
}

void Loads::add_following(const Pressure& pressure, std::span<const Point> reference, const Field& H, FieldView force) const {
  const auto d = static_cast<std::size_t>(body_->dimension());
  for (std::size_t k = 0; k < pressure.points.size(); ++k) {
    const std::int32_t p = pressure.points[k];
    // H holds the in-space components row by row, then the other diagonal ones.
    std::array<std::array<double, 3>, 3> F{};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < d && a < d; ++b) F[a][b] = H.component(static_cast<int>(a * d + b))[p];
      if (a >= d) F[a][a] = H.component(static_cast<int>(d * d + a - d))[p];
      F[a][a] += 1;
    }
    for (std::size_t a = 0; a < d; ++a) {
      const std::size_t a1 = (a + 1) % 3, a2 = (a + 2) % 3;
      double along = 0;  // (cof F p area)_a
      for (std::size_t b = 0; b < d; ++b) {
        const std::size_t b1 = (b + 1) % 3, b2 = (b + 2) % 3;
        along += (F[a1][b1] * F[a2][b2] - F[a1][b2] * F[a2][b1]) * reference[k][b];
      }
      force.component(static_cast<int>(a))[p] -= along;
    }
  }
}

}  // namespace perikit
