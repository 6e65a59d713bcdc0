#include "perikit/problem/constraints.hpp"

#include <algorithm>
#include <cmath>

#include "problem/snapshot.hpp"

namespace perikit {

Constraints::Constraints(const Body& body, std::vector<Prescription> prescriptions) : body_(&body) {
  const std::size_t stride = body.stride();
  std::vector<std::int32_t> governor(stride * static_cast<std::size_t>(body.dimension()), -1);
  const auto governor_of = [&](const Prescription& p, std::int32_t point) -> std::int32_t& {
    return governor[static_cast<std::size_t>(p.component) * stride + static_cast<std::size_t>(point)];
  };
  for (std::size_t k = 0; k < prescriptions.size(); ++k)
    for (const std::int32_t point : prescriptions[k].points) governor_of(prescriptions[k], point) = static_cast<std::int32_t>(k);
  for (std::size_t k = 0; k < prescriptions.size(); ++k) {
    Governed governed{std::move(prescriptions[k]), {}};
    std::erase_if(governed.points,
                  [&](std::int32_t point) { return governor_of(governed, point) != static_cast<std::int32_t>(k); });
    std::ranges::sort(governed.points);
    if (!governed.value.depends_on_time)
      for (const std::int32_t p : governed.points)
        governed.fixed.push_back(governed.value.value(body.position(static_cast<std::size_t>(p)), 0.0));
    governed_.push_back(std::move(governed));
  }
  for (std::size_t dof = 0; dof < governor.size(); ++dof)
    if (governor[dof] >= 0) dofs_.push_back(static_cast<std::int64_t>(dof));
}

double Constraints::value(const Governed& governed, std::size_t k, double t) const {
  if (!governed.fixed.empty()) return governed.value.ramps ? t * governed.fixed[k] : governed.fixed[k];
  return governed.value(body_->position(static_cast<std::size_t>(governed.points[k])), t);
}

ConstFieldView Constraints::free() const {
  if (free_.size() == 0) {
    free_ = body_->make_field(body_->dimension());
    for (int c = 0; c < free_.components(); ++c)
      for (const std::int32_t p : body_->owned()) free_.component(c)[p] = 1.0;
    for (const std::int64_t dof : dofs_) free_.data()[dof] = 0.0;
  }
  return free_;
}

std::size_t Constraints::points_held_at_rest() const {
  std::vector<int> held(body_->stride(), 0);
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.fixed.size(); ++k)
      held[static_cast<std::size_t>(governed.points[k])] += governed.fixed[k] == 0;
  return static_cast<std::size_t>(std::ranges::count(held, body_->dimension()));
}

void Constraints::prescribe_displacement(double t, FieldView u) const {
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.points.size(); ++k)
      u.component(governed.component)[governed.points[k]] = value(governed, k, t);
}

void Constraints::prescribe_half_step_velocity(double t_begin, double t_end, ConstFieldView u, FieldView v) {
  last_step_ = t_end - t_begin;
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.points.size(); ++k) {
      const std::int32_t p = governed.points[k];
      v.component(governed.component)[p] =
          governed.velocity ? value(governed, k, 0.5 * (t_begin + t_end))
                            : (value(governed, k, t_end) - u.component(governed.component)[p]) / (t_end - t_begin);
    }
}

void Constraints::prescribe_velocity(double t, FieldView v) const {
  const double h = 1e-3 * std::max(last_step_, 1e-9 * std::abs(t));
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.points.size(); ++k) {
      double& velocity = v.component(governed.component)[governed.points[k]];
      if (governed.velocity)
        velocity = value(governed, k, t);
      else if (governed.value.depends_on_time && h > 0)
        velocity = (value(governed, k, t + h) - value(governed, k, t - h)) / (2 * h);
      else
        velocity = 0.0;
    }
}

void Constraints::prescribe_acceleration(double t, FieldView a) const {
  // Differences over whole steps: over a small part of one, rounding would grow with the square of the number of steps.
  const double h = last_step_;
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.points.size(); ++k) {
      const auto at = [&](double time) { return value(governed, k, time); };
      double& acceleration = a.component(governed.component)[governed.points[k]];
      if (!governed.value.depends_on_time || h <= 0)
        acceleration = 0.0;
      else if (governed.velocity)
        acceleration = (at(t + h / 2) - at(t - h / 2)) / h;
      else
        acceleration = (at(t + h) - 2 * at(t) + at(t - h)) / (h * h);
    }
}

void Constraints::write(ByteWriter& out) const {
  out.value(last_step_);
}

void Constraints::read(ByteReader& in) {
  last_step_ = in.value<double>();
}

}  // namespace perikit
