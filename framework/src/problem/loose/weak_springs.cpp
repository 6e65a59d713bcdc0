#include "problem/loose/weak_springs.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "problem/loose/loose_points.hpp"

namespace perikit {

namespace {

std::vector<std::int32_t> points_of(const std::vector<LoosePiece>& pieces) {
  std::vector<std::int32_t> points;
  for (const LoosePiece& piece : pieces) points.insert(points.end(), piece.points.begin(), piece.points.end());
  std::ranges::sort(points);
  return points;
}

}  // namespace

WeakSprings::WeakSprings(const Families& families, Problem& problem, Terms& terms, double share)
    : families_(families),
      problem_(problem),
      terms_(terms),
      share_(share),
      loose_(families.body().stride(), 0),
      anchor_(share > 0 ? problem.state().declare("weak_spring_anchor") : FieldView{}) {}

void WeakSprings::find(ConstFieldView u, bool fresh) {
  // A rank without others does not know what holds its part beyond it.
  if (communicator().complete()) pieces_ = find_loose_pieces(families_, problem_, terms_, u);
  points_ = points_of(pieces_);
  any_ = communicator().largest(pieces_.empty() ? 0 : 1) > 0;
  std::vector<std::uint8_t> now(loose_.size(), 0);
  for (const std::int32_t p : points_) {
    now[static_cast<std::size_t>(p)] = 1;
    if (!anchor_.data || !fresh || loose_[static_cast<std::size_t>(p)]) continue;
    for (int c = 0; c < u.components; ++c) anchor_.component(c)[p] = u.component(c)[p];
  }
  loose_ = std::move(now);
}

std::string WeakSprings::names() const { return perikit::names(pieces_, families_.body()); }

EvaluationStatus WeakSprings::refuse(ConstFieldView u) const {
  if (share_ > 0 || !any_ || !problem_.loads().any()) return {};
  const LoosePiece* const piece = driven_piece(pieces_, families_.body(), u, problem_.state().external_force());
  if (!piece) return {};
  return {piece->first, 0,
          fmt::format("nothing holds {}, and the loads move it ([run] weak_springs would hold it)", piece->name(families_.body()))};
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
