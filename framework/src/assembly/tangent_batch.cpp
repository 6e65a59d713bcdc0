#include "assembly/tangent_batch.hpp"

#include <algorithm>

#include "core/symmetric_matrix.hpp"
#include "maps/selective_tangent.hpp"
#include "maps/selective_map.hpp"
#include "operators/volume_stiffness.hpp"

namespace perikit {

template <int D>
TangentBatch<D>::TangentBatch(const LawsOfSpace& laws, bool selective)
    : of_(laws), points_(laws.points), laws_(points_.laws()), selective_(selective) {
  laws_.prepare(scratch_, true);
  A_.assign(static_cast<std::size_t>(laws_.components() * laws_.components()) * batch_points, 0.0);
  state_.assign(points_.components() * batch_points, 0.0);
  if (!selective) return;
  P_.assign(9 * batch_points, 0.0);
  mapped_.assign(9 * batch_points, 0.0);
  growth_.assign(batch_points, 0.0);
  inverse_.assign(batch_points, 0.0);
  volume_.assign(volume_components * batch_points, 0.0);
  for (std::size_t first = 0; first < batch_points; first += padding) volume_group_.push_back(static_cast<std::int64_t>(first));
}

template <int D>
int TangentBatch<D>::add(std::size_t owner, std::int32_t far, int part, double weight, double share) {
  const int lane = lanes_++;
  if (static_cast<std::size_t>(lane) == owner_.size()) {
    const std::size_t size = owner_.size() + batch_points;
    owner_.resize(size);
    far_.resize(size, -1);
    weight_.resize(size);
    share_.resize(size);
    if (points_.remember()) number_.resize(size);
    H_.resize(size * stored, 0.0);
    own_.resize(size * entries);
    if (selective_) {
      Hbar_.resize(size * stored, 0.0);
      mixed_.resize(size * entries);
      back_.resize(size * entries);
      bar_.resize(size * entries);
    }
  }
  owner_[static_cast<std::size_t>(lane)] = static_cast<std::int32_t>(owner);
  far_[static_cast<std::size_t>(lane)] = far;
  weight_[static_cast<std::size_t>(lane)] = weight;
  share_[static_cast<std::size_t>(lane)] = share;
  if (!points_.remember() && !of_.laminates) return lane;
  const PointNumbers number = of_.space.number_of(static_cast<std::int32_t>(owner), far, part);
  if (points_.remember()) number_[static_cast<std::size_t>(lane)] = number.state;
  if (const LaminatePoint* const laminate = of_.laminates && number.point >= 0 ? of_.laminates->at(number.point) : nullptr) laminates_.push_back({lane, *laminate});
  return lane;
}

template <int D>
int TangentBatch<D>::evaluate(const Configuration& at, bool convex) {
  for (int first = 0; first < lanes_; first += batch_points) {
    const int n = std::min(batch_points, lanes_ - first), last = first + static_cast<int>(padded(static_cast<std::size_t>(n)));
    for (int lane = first + n; lane < last; ++lane) {  // padding at rest
      owner_[static_cast<std::size_t>(lane)] = owner_[static_cast<std::size_t>(first)];
      for (int c = 0; c < components; ++c) {
        H(lane, c) = 0;
        if (selective_) owner_H(lane, c) = 0;
      }
    }
    const int bad = selective_ ? evaluate_selective(first, n, at) : evaluate_plain(first, n, at);
    if (bad >= 0) return first + bad;
  }
  for (int lane = 0; convex && lane < lanes_; ++lane) remove_negative_curvature(lane);
  return -1;
}

template <int D>
void TangentBatch<D>::remove_negative_curvature(int lane) {
  const auto at = static_cast<std::size_t>(lane) * entries;
  if (!selective_) return make_semidefinite(own_.data() + at, components);
  // Of [own mixed; mixed^T bar] as a whole.
  constexpr int n = 2 * components;
  double A[n * n];
  const auto place = [&](int r, int c) -> double& {
    const bool right = c >= components, below = r >= components;
    const int row = r % components, column = c % components;
    return right && below ? bar_[at + row * components + column]
           : right        ? mixed_[at + row * components + column]
           : below        ? mixed_[at + column * components + row]
                          : own_[at + row * components + column];
  };
  for (int k = 0; k < n * n; ++k) A[k] = place(k / n, k % n);
  make_semidefinite(A, n);
  for (int k = 0; k < n * n; ++k)
    if (k / n < components || k % n >= components) place(k / n, k % n) = A[k];
  for (int r = 0; r < components; ++r)
    for (int c = 0; c < components; ++c) back_[at + c * components + r] = mixed_[at + r * components + c];
}

template <int D>
LawBatch TangentBatch<D>::batch_of(int first, int n, const Configuration& at) {
  LawBatch batch;
  batch.n = n;
  batch.points = owner_.data() + first;
  batch.A = A_.data();
  batch.external = {at.external(), owner_.data() + first, far_.data() + first};
  if (!points_.remember()) return batch;
  points_.gather({number_.data() + first, static_cast<std::size_t>(n)}, state_.data());
  batch.state = {state_.data(), nullptr, batch_points, at.time_step()};
  return batch;
}

template <int D>
int TangentBatch<D>::evaluate_plain(int first, int n, const Configuration& at) {
  LawBatch batch = batch_of(first, n, at);
  batch.H = &H(first, 0);
  const Status status = laws_.evaluate(batch, scratch_);
  if (!status.ok()) return status.inadmissible;
  if (const int bad = evaluate_laminates(first, n, &H(first, 0)); bad >= 0) return bad;
  const int all = laws_.components();
  for (int l = 0; l < n; ++l) {
    double* out = own_.data() + static_cast<std::size_t>(first + l) * entries;
    const double weight = weight_[static_cast<std::size_t>(first + l)];
    for (int r = 0; r < components; ++r)
      for (int c = 0; c < components; ++c)
        out[r * components + c] = weight * A_[static_cast<std::size_t>((r * all + c) * batch_points + l)];
  }
  return -1;
}

/// The laminates among lanes first ... first + n - 1, in place of what one law gave there.
template <int D>
int TangentBatch<D>::evaluate_laminates(int first, int n, const double* H) {
  const auto begin = std::ranges::lower_bound(laminates_, first, {}, &Laminate::lane);
  const auto end = std::ranges::lower_bound(laminates_, first + n, {}, &Laminate::lane);
  if (begin == end) return -1;
  if (!laminate_scratch_) laminate_scratch_ = std::make_unique<LaminateScratch>(laws_);
  int lane[batch_points];
  const LaminatePoint* point[batch_points];
  LaminateBatch batch;
  for (auto at = begin; at != end; ++at) {
    if (laws_.record_of(static_cast<std::size_t>(owner(at->lane))).silent) continue;
    lane[batch.n] = at->lane - first;
    point[batch.n++] = &at->point;
  }
  batch.lane = lane;
  batch.laminate = point;
  batch.H = H;
  batch.P = P_.data();
  batch.A = A_.data();
  return laminate_scratch_->evaluate(batch);
}

template <int D>
int TangentBatch<D>::evaluate_selective(int first, int n, const Configuration& at) {
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  owner_volume(laws_.space(), {lanes, batch_points, &owner_H(first, 0), nullptr}, volume_.data(), batch_points);
  std::copy_n(share_.data() + first, lanes, volume_.data() + volume_share * batch_points);
  const OwnerVolumes owners{volume_.data(), batch_points, volume_group_.data(), false};
  selective_map(laws_.space(), {lanes, 1, &H(first, 0), nullptr, owners, inverse_.data(), growth_.data()}, mapped_.data(), nullptr);
  LawBatch batch = batch_of(first, n, at);
  batch.H = mapped_.data();
  batch.P = P_.data();
  const Status status = laws_.evaluate(batch, scratch_);
  if (!status.ok()) return status.inadmissible;
  if (const int bad = evaluate_laminates(first, n, mapped_.data()); bad >= 0) return bad;
  for (int l = 0; l < n; ++l) {
    const auto at = static_cast<std::size_t>(first + l), lane = at * entries;
    const SelectiveLane in{&H(first, 0) + l, &owner_H(first, 0) + l, P_.data() + l, A_.data() + l, growth_[static_cast<std::size_t>(l)],
                           share_[at], weight_[at]};
    selective_tangent<D>(in, own_.data() + lane, mixed_.data() + lane, back_.data() + lane, bar_.data() + lane);
  }
  return -1;
}

template <int D>
double TangentBatch<D>::volume_stiffness(int lane) const noexcept {
  const int all = laws_.components();
  double F[9], P[9], AF[9] = {};
  for (int c = 0; c < all; ++c) {
    F[c] = mapped_[static_cast<std::size_t>(c * batch_points + lane)] + (c >= D * D || c % (D + 1) == 0 ? 1.0 : 0.0);
    P[c] = P_[static_cast<std::size_t>(c * batch_points + lane)];
  }
  for (int k = 0; k < all * all; ++k) AF[k / all] += A_[static_cast<std::size_t>(k * batch_points + lane)] * F[k % all];
  return weight_[static_cast<std::size_t>(lane)] * perikit::volume_stiffness(all, 1, F, P, AF);
}

template class TangentBatch<1>;
template class TangentBatch<2>;
template class TangentBatch<3>;

}  // namespace perikit
