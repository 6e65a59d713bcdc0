#include "perikit/problem/constraints.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "problem/snapshot.hpp"

namespace perikit {

Constraints::Constraints(const Body& body, std::vector<Prescription> prescriptions, const Images& images, std::vector<FaceMotion> motions)
    : body_(&body), motions_(std::move(motions)) {
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
  add_held(images);
  add_images(images);
  std::ranges::sort(dofs_);
}

void Constraints::add_images(const Images& images) {
  const std::size_t real = body_->points() - images.size();
  for (const ImageTerm& term : images.terms) {
    const std::int32_t point = body_->internal()[real + static_cast<std::size_t>(term.image)];
    if (!body_->owns(static_cast<std::size_t>(point))) continue;  // its rank says where it is
    const std::int64_t dof = term.component * static_cast<std::int64_t>(body_->stride()) + point;
    // Terms of one component of an image follow each other.
    if (image_dofs_.empty() || image_dofs_.back().dof != dof) {
      image_dofs_.push_back({dof, false, false, shares_.size(), shares_.size()});
      dofs_.push_back(dof);
    }
    if (term.motion < 0) continue;
    const FaceMotion& motion = motions_[static_cast<std::size_t>(term.motion)];
    ImageDof& image = image_dofs_.back();
    if (image.first < image.last && image.velocity != motion.velocity)
      throw std::domain_error("found a face with a velocity beside one with a displacement, which it meets; allowed: the same key for both");
    image.velocity = motion.velocity;
    image.depends_on_time = image.depends_on_time || motion.value.depends_on_time;
    shares_.push_back({term.motion, term.factor, term.at, motion.value.depends_on_time ? 0.0 : motion.value.value(term.at, 0.0)});
    image.last = shares_.size();
  }
}

void Constraints::add_held(const Images& images) {
  const std::size_t of_layers = dofs_.size();
  for (std::size_t k = 0; k < images.held.size(); ++k) {
    const HeldPoint& held = images.held[k];
    const std::int32_t point = body_->internal()[static_cast<std::size_t>(held.point)];
    if (!body_->owns(static_cast<std::size_t>(point))) continue;
    bool last = true;  // of its component
    for (std::size_t j = k + 1; j < images.held.size() && images.held[j].point == held.point; ++j) last &= images.held[j].component != held.component;
    const std::int64_t dof = held.component * static_cast<std::int64_t>(body_->stride()) + point;
    if (!last || std::binary_search(dofs_.begin(), dofs_.begin() + static_cast<std::ptrdiff_t>(of_layers), dof)) continue;
    image_dofs_.push_back({dof, false, false, shares_.size(), shares_.size()});
    dofs_.push_back(dof);
    if (held.motion < 0) continue;
    const FaceMotion& motion = motions_[static_cast<std::size_t>(held.motion)];
    const Point x = body_->position(static_cast<std::size_t>(point));
    image_dofs_.back().velocity = motion.velocity;
    image_dofs_.back().depends_on_time = motion.value.depends_on_time;
    shares_.push_back({held.motion, 1.0, x, motion.value.depends_on_time ? 0.0 : motion.value.value(x, 0.0)});
    image_dofs_.back().last = shares_.size();
  }
}

double Constraints::value(const ImageDof& image, double t) const {
  double sum = 0;
  for (std::size_t k = image.first; k < image.last; ++k) {
    const Share& share = shares_[k];
    const SpaceTimeFunction& function = motions_[static_cast<std::size_t>(share.motion)].value;
    sum += share.factor * (function.depends_on_time ? function.value(share.at, t) : function.ramps ? t * share.fixed : share.fixed);
  }
  return sum;
}

template <class Visit>
void Constraints::each(Visit&& visit) const {
  for (const Governed& governed : governed_)
    for (std::size_t k = 0; k < governed.points.size(); ++k)
      visit(static_cast<std::int64_t>(governed.component) * static_cast<std::int64_t>(body_->stride()) + governed.points[k], governed.velocity,
            governed.value.depends_on_time, [&](double t) { return value(governed, k, t); });
  for (const ImageDof& image : image_dofs_) visit(image.dof, image.velocity, image.depends_on_time, [&](double t) { return value(image, t); });
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
  each([&](std::int64_t dof, bool, bool, auto&& value) { u.data[dof] = value(t); });
}

void Constraints::start_images(const std::function<double(int, const Point&)>& initial, bool dynamic, FieldView u) const {
  for (const ImageDof& image : image_dofs_) {
    const bool prescribed = dynamic && !image.velocity;
    double sum = prescribed ? value(image, 0) : 0.0;
    for (std::size_t k = image.first; k < image.last && !prescribed; ++k)
      sum += shares_[k].factor * initial(static_cast<int>(image.dof / static_cast<std::int64_t>(u.stride)), shares_[k].at);
    u.data[image.dof] = sum;
  }
}

void Constraints::prescribe_half_step_velocity(double t_begin, double t_end, ConstFieldView u, FieldView v) {
  last_step_ = t_end - t_begin;
  each([&](std::int64_t dof, bool velocity, bool, auto&& value) {
    v.data[dof] = velocity ? value(0.5 * (t_begin + t_end)) : (value(t_end) - u.data[dof]) / (t_end - t_begin);
  });
}

void Constraints::prescribe_velocity(double t, FieldView v) const {
  const double h = 1e-3 * std::max(last_step_, 1e-9 * std::abs(t));
  each([&](std::int64_t dof, bool velocity, bool depends_on_time, auto&& value) {
    if (velocity) v.data[dof] = value(t);
    else if (depends_on_time && h > 0) v.data[dof] = (value(t + h) - value(t - h)) / (2 * h);
    else v.data[dof] = 0.0;
  });
}

void Constraints::prescribe_acceleration(double t, FieldView a) const {
  // Differences over whole steps: over a small part of one, rounding would grow with the square of the number of steps.
  const double h = last_step_;
  each([&](std::int64_t dof, bool velocity, bool depends_on_time, auto&& value) {
    if (!depends_on_time || h <= 0) a.data[dof] = 0.0;
    else if (velocity) a.data[dof] = (value(t + h / 2) - value(t - h / 2)) / h;
    else a.data[dof] = (value(t + h) - 2 * value(t) + value(t - h)) / (h * h);
  });
}

void Constraints::write(ByteWriter& out) const {
  out.value(last_step_);
}

void Constraints::read(ByteReader& in) {
  last_step_ = in.value<double>();
}

}  // namespace perikit
