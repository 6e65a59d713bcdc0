#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "face_loads.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

double BodyProblem::Constraint::at(const Body& body, std::size_t k, double t) const {
  if (!fixed.empty()) return ramp ? t * fixed[k] : fixed[k];
  return value(body.position(static_cast<std::size_t>(points[k])), t);
}

void BodyProblem::read_constraints(bool quasi_static) {
  // A later [[boundary]] governs the components that it prescribes, whatever an earlier one says of them.
  std::vector<std::int32_t> governor(stride() * static_cast<std::size_t>(dimension()), -1);
  for (std::size_t k = 0; k < scene_.boundaries.size(); ++k) {
    const BoundaryDescription& boundary = scene_.boundaries[k];
    if (boundary.velocity && quasi_static) {
      throw InputError(boundary.position, fmt::format("boundary.{}.velocity", k),
                       "found in a quasi-static run; allowed: displacement");
    }
    for (std::size_t c = 0; c < boundary.components.size(); ++c) {
      if (!boundary.components[c]) continue;
      Constraint constraint;
      constraint.velocity = boundary.velocity;
      constraint.component = static_cast<int>(c);
      constraint.value = *boundary.components[c];
      constraint.ramp = quasi_static && constraint.value.is_number();
      constraint.points = body_.set(boundary.set);
      for (const std::int32_t p : constraint.points) governor[c * stride() + static_cast<std::size_t>(p)] = static_cast<std::int32_t>(constraints_.size());
      constraints_.push_back(std::move(constraint));
    }
  }
  for (std::size_t k = 0; k < constraints_.size(); ++k) {
    Constraint& constraint = constraints_[k];
    std::erase_if(constraint.points, [&](std::int32_t p) {
      return governor[static_cast<std::size_t>(constraint.component) * stride() + static_cast<std::size_t>(p)] != static_cast<std::int32_t>(k);
    });
    std::sort(constraint.points.begin(), constraint.points.end());
    if (!constraint.value.depends_on_time()) {
      for (const std::int32_t p : constraint.points) constraint.fixed.push_back(constraint.value(body_.position(static_cast<std::size_t>(p))));
    }
  }
  for (std::size_t dof = 0; dof < governor.size(); ++dof) {
    if (governor[dof] >= 0) constrained_.push_back(static_cast<std::int64_t>(dof));
  }
}

std::size_t BodyProblem::points_held_at_rest() const {
  std::vector<int> held(stride(), 0);
  for (const Constraint& constraint : constraints_)
    for (std::size_t k = 0; k < constraint.fixed.size(); ++k) held[static_cast<std::size_t>(constraint.points[k])] += constraint.fixed[k] == 0;
  return static_cast<std::size_t>(std::count(held.begin(), held.end(), dimension()));
}

ConstFieldView BodyProblem::free_mask() const noexcept {
  if (free_mask_.size() == 0) {
    free_mask_ = body_.make_field(dimension());
    for (int c = 0; c < dimension(); ++c)
      for (const std::int32_t p : body_.owned()) free_mask_.component(c)[p] = 1.0;
    for (const std::int64_t dof : constrained_) free_mask_.data()[dof] = 0.0;
  }
  return free_mask_;
}

void BodyProblem::prescribe_half_step_velocity(double t_begin, double t_end, FieldView v) {
  last_step_ = t_end - t_begin;
  for (const Constraint& constraint : constraints_) {
    double* values = v.component(constraint.component);
    const double* u = displacement_.component(constraint.component);
    for (std::size_t k = 0; k < constraint.points.size(); ++k) {
      const std::int32_t p = constraint.points[k];
      values[p] = constraint.velocity ? constraint.at(body_, k, 0.5 * (t_begin + t_end))
                                      : (constraint.at(body_, k, t_end) - u[p]) / (t_end - t_begin);
    }
  }
}

void BodyProblem::prescribe_velocity(double t, FieldView v) {
  const double h = 1e-3 * std::max(last_step_, 1e-9 * std::abs(t));
  for (const Constraint& constraint : constraints_) {
    double* values = v.component(constraint.component);
    for (std::size_t k = 0; k < constraint.points.size(); ++k) {
      double& value = values[constraint.points[k]];
      if (constraint.velocity) value = constraint.at(body_, k, t);
      else value = constraint.fixed.empty() && h > 0 ? (constraint.at(body_, k, t + h) - constraint.at(body_, k, t - h)) / (2 * h) : 0.0;
    }
  }
}

void BodyProblem::prescribe_acceleration(double t, FieldView a) const {
  // Differences over whole steps: over a small part of one, rounding would grow with the square of the number of steps.
  const double h = last_step_;
  for (const Constraint& constraint : constraints_) {
    double* values = a.component(constraint.component);
    for (std::size_t k = 0; k < constraint.points.size(); ++k) {
      const auto at = [&](double time) { return constraint.at(body_, k, time); };
      double& value = values[constraint.points[k]];
      if (!constraint.fixed.empty() || h <= 0) value = 0.0;
      else if (constraint.velocity) value = (at(t + h / 2) - at(t - h / 2)) / h;
      else value = (at(t + h) - 2 * at(t) + at(t - h)) / (h * h);
    }
  }
}

void BodyProblem::prescribe_displacement(double t, FieldView u) {
  for (const Constraint& constraint : constraints_) {
    double* values = u.component(constraint.component);
    for (std::size_t k = 0; k < constraint.points.size(); ++k) values[constraint.points[k]] = constraint.at(body_, k, t);
  }
}

void BodyProblem::read_loads(bool quasi_static) {
  const Body& body = whole();   // totals are those of all ranks
  for (const LoadDescription& description : scene_.loads) {
    std::vector<std::int32_t> points = body.set(description.set);
    std::vector<double> share;
    if (description.type == LoadDescription::Type::traction) {
      share = face_shares(body, description, points);
    } else {
      double total = 0;
      for (const std::int32_t p : points) total += body.volume(static_cast<std::size_t>(p));
      for (const std::int32_t p : points) {
        const double volume = body.volume(static_cast<std::size_t>(p));
        share.push_back(description.type == LoadDescription::Type::force ? volume / total : volume);
      }
    }
    keep_owned(points, share);
    for (std::size_t c = 0; c < description.components.size(); ++c) {
      const Expression& value = description.components[c];
      if (value.is_number() && value({}) == 0.0) continue;
      loads_.push_back({static_cast<int>(c), value, quasi_static && value.is_number(), points, share});
    }
  }
}

void BodyProblem::keep_owned(std::vector<std::int32_t>& points, std::vector<double>& share) const {
  if (!partition_) return;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::int32_t input = whole().input_of(static_cast<std::size_t>(points[k]));
    if (!partition_->owns(input)) continue;
    points[kept] = body_.internal()[static_cast<std::size_t>(partition_->place(input))];
    share[kept++] = share[k];
  }
  points.resize(kept);
  share.resize(kept);
}

std::vector<double> BodyProblem::face_shares(const Body& body, const LoadDescription& load, std::vector<std::int32_t>& points) const {
  const int axis = load.face[1] - 'x';
  const double outward = load.face[0] == '+' ? 1.0 : -1.0;
  const double dx = body.spacing();
  std::map<std::int32_t, double> shares;
  if (const Lattice* lattice = body.lattice()) {
    // Each column of cells below the face carries what the kinematics has of it there: a homogeneous stress is then in equilibrium point
    // by point. (On clouds no load on faces alone does that.) Pair laws have no homogeneous stress near a face: the face lies half a spacing beyond the last
    // layer, and 3/2 there and -1/2 one layer further in give the exact total and the exact moment.
    std::array<int, 3> step{};
    for (std::size_t k = 0; k < 3; ++k) step[k] = lattice->axis[k] == axis ? static_cast<int>(outward) : 0;
    const std::int64_t shift = lattice->shift(step);
    // A dead cell beyond the last row may be outside of the padding where the family has no reach along this axis.
    const auto alive = [&](std::int64_t p, int sign) {
      std::array<std::int64_t, 3> k = lattice->cell(p);
      for (std::size_t a = 0; a < 3; ++a) {
        k[a] += sign * step[a];
        if (k[a] < 0 || k[a] >= lattice->extent[a]) return false;
      }
      return body.alive(static_cast<std::size_t>(p + sign * shift));
    };
    const bool exact = !formulation_.pairs && formulation_.force_state == ForceState::variational;
    const Field areas = exact ? face_areas(body, formulation_, influence_, axis) : Field();
    const auto layers = static_cast<std::int64_t>(std::ceil(3 * body.horizon() / dx));   // that a face is felt in
    const double area = body.uniform_volume() / dx;
    double total = 0, wanted = 0;
    for (const std::int32_t p : points) {
      if (alive(p, 1)) continue;
      wanted += area;
      std::int64_t depth = 1;   // of the column, as far as it matters
      while (depth < 2 * layers && alive(p - (depth - 1) * shift, -1)) ++depth;
      if (!exact || depth == 1) {
        shares[p] += depth > 1 ? 1.5 * area : area;
        if (depth > 1) shares[static_cast<std::int32_t>(p - shift)] -= 0.5 * area;
        total += area;
        continue;
      }
      // What is nearer to the opposite face belongs to that one.
      for (std::int64_t k = 0; k < std::min(layers, depth / 2); ++k) {
        const double own = outward * areas.data()[p - k * shift];
        shares[static_cast<std::int32_t>(p - k * shift)] += own;
        total += own;
      }
    }
    for (auto& [p, value] : shares) value *= wanted / total;
  } else {
    // A cloud: points less than 1.2 spacings below the face are its outer layer, and their volumes over the spacing its area. Where
    // the set holds a second layer, linear weights over both put the resultant on the face.
    const auto along = [&](std::int32_t p) { return outward * body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(axis)]; };
    double extreme = -std::numeric_limits<double>::infinity();
    for (const std::int32_t p : points) extreme = std::max(extreme, along(p));
    double total = 0, m0 = 0, m1 = 0, m2 = 0;
    bool second = false;
    for (const std::int32_t p : points) {
      const double depth = extreme + 0.5 * dx - along(p), v = body.volume(static_cast<std::size_t>(p));
      if (depth > 2.2 * dx) continue;
      if (depth <= 1.2 * dx) total += v / dx;
      else second = true;
      m0 += v;
      m1 += v * depth;
      m2 += v * depth * depth;
    }
    for (const std::int32_t p : points) {
      const double depth = extreme + 0.5 * dx - along(p), v = body.volume(static_cast<std::size_t>(p));
      if (depth > 2.2 * dx) continue;
      shares[p] = second ? total * v * (m2 - m1 * depth) / (m0 * m2 - m1 * m1) : total * v / m0;
    }
  }
  if (shares.empty()) {
    throw InputError(
        load.position, "load.face",
        fmt::format("found \"{}\", on which no point of the set \"{}\" lies; allowed: a face of the set", load.face, load.set));
  }
  points.clear();
  std::vector<double> share;
  for (const auto& [p, value] : shares) {
    points.push_back(p);
    share.push_back(value);
  }
  return share;
}

void BodyProblem::evaluate_loads(double t, FieldView force) {
  std::fill_n(force.data, force.size(), 0.0);
  for (const Load& load : loads_) {
    double* f = force.component(load.component);
    const bool everywhere = !load.value.depends_on_position();
    const double common = everywhere ? load.value({}, t) : 0.0;
    for (std::size_t k = 0; k < load.points.size(); ++k) {
      const double value = everywhere ? common : load.value(body_.position(static_cast<std::size_t>(load.points[k])), t);
      f[load.points[k]] += load.share[k] * (load.ramp ? t * value : value);
    }
  }
}

bool BodyProblem::loads_depend_on_time() const noexcept {
  return std::any_of(loads_.begin(), loads_.end(), [](const Load& load) { return load.ramp || load.value.depends_on_time(); });
}

}  // namespace perikit
