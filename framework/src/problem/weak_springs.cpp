#include "problem/weak_springs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"
#include "problem/loose_points.hpp"

namespace perikit {

namespace {

/// Points and images that no other rank has.
std::vector<std::int32_t> own_points(const Body& body) {
  std::vector<std::int32_t> own;
  std::ranges::copy_if(body.internal(), std::back_inserter(own), [&](std::int32_t p) { return body.owns(static_cast<std::size_t>(p)); });
  return own;
}

std::vector<std::int32_t> points_of(const std::vector<LoosePiece>& pieces) {
  std::vector<std::int32_t> points;
  for (const LoosePiece& piece : pieces) points.insert(points.end(), piece.points.begin(), piece.points.end());
  std::ranges::sort(points);
  return points;
}

}  // namespace

WeakSprings::WeakSprings(const Families& families, Problem& problem, double share, const WholeBody* whole)
    : families_(families),
      problem_(problem),
      share_(share),
      whole_(whole),
      loose_(families.body().stride(), 0),
      anchor_(share > 0 ? problem.state().declare("weak_spring_anchor") : FieldView{}) {
  if (communicator().size() > 1) first_rank_.emplace(families.body(), own_points(families.body()));
}

void WeakSprings::find(ConstFieldView u, bool fresh) {
  const Body& body = families_.body();
  if (!first_rank_) {
    pieces_ = find_loose_pieces(families_, problem_.constraints(), problem_.images(), u);
    points_ = points_of(pieces_);
    any_ = !pieces_.empty();
  } else {
    const Field of_all = first_rank_->gather(u);
    if (whole_) pieces_ = find_loose_pieces(*whole_->families, whole_->constraints, whole_->images.get(), of_all);
    const std::vector<std::int32_t> places = told_to_all(points_of(pieces_));
    any_ = !places.empty();
    points_.clear();
    std::ranges::copy_if(body.owned(), std::back_inserter(points_), [&](std::int32_t p) {
      return std::ranges::binary_search(places, body.places().place[static_cast<std::size_t>(p)]);
    });
  }
  std::vector<std::uint8_t> now(loose_.size(), 0);
  for (const std::int32_t p : points_) {
    now[static_cast<std::size_t>(p)] = 1;
    if (!anchor_.data || !fresh || loose_[static_cast<std::size_t>(p)]) continue;
    for (int c = 0; c < u.components; ++c) anchor_.component(c)[p] = u.component(c)[p];
  }
  loose_ = std::move(now);
}

std::string WeakSprings::names() const {
  if (!first_rank_) return perikit::names(pieces_, families_.body());
  const std::string mine = whole_ ? perikit::names(pieces_, whole_->families->body()) : std::string();
  const std::vector<char> told = told_to_all(std::vector<char>(mine.begin(), mine.end()));
  return {told.begin(), told.end()};
}

EvaluationStatus WeakSprings::driven(const Body& body, ConstFieldView u, ConstFieldView force) const {
  const LoosePiece* const piece = driven_piece(pieces_, body, u, force);
  if (!piece) return {};
  return {body.input_of(static_cast<std::size_t>(piece->points.front())), 0,
          fmt::format("nothing holds {}, and the loads move it ([run] weak_springs would hold it)", piece->name(body))};
}

EvaluationStatus WeakSprings::refuse(ConstFieldView u) const {
  if (share_ > 0 || !any_ || !problem_.loads().any()) return {};
  const ConstFieldView force = problem_.state().external_force();
  if (!first_rank_) return driven(families_.body(), u, force);
  const Field u_of_all = first_rank_->gather(u), force_of_all = first_rank_->gather(force);
  return whole_ ? driven(whole_->families->body(), u_of_all, force_of_all) : EvaluationStatus{};
}

double WeakSprings::stiffness(std::int32_t point) const {
  const auto p = static_cast<std::size_t>(point);
  const Moduli moduli = problem_.laws().moduli(p);
  const double dx = families_.body().spacing();
  return share_ * (moduli.lambda + 2 * moduli.mu) * families_.body().volume(p) / (dx * dx);
}

void WeakSprings::add_forces(ConstFieldView u, FieldView force, double* energy) const {
  ExactSum stored;
  for (const std::int32_t p : points_) {
    const double k = stiffness(p);
    for (int c = 0; c < u.components; ++c) {
      const double off = u.component(c)[p] - anchor_.component(c)[p];
      force.component(c)[p] -= k * off;
      if (energy) stored.add(0.5 * k * off * off);
    }
  }
  if (energy) *energy += total_over_ranks(stored);
}

void WeakSprings::add_tangent(ConstFieldView w, FieldView Kw) const {
  for (const std::int32_t p : points_)
    for (int c = 0; c < w.components; ++c) Kw.component(c)[p] += stiffness(p) * w.component(c)[p];
}

void WeakSprings::add_to(BlockMatrix& K) const {
  const auto d = static_cast<std::size_t>(K.dimension);
  for (std::size_t row = 0; row < K.rows(); ++row) {
    if (!loose_[static_cast<std::size_t>(K.point[row])]) continue;
    for (std::size_t c = 0; c < d; ++c) diagonal_block(K, row)[c * d + c] += stiffness(K.point[row]);
  }
}

}  // namespace perikit
