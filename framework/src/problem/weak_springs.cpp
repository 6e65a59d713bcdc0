#include "problem/weak_springs.hpp"

#include <fmt/format.h>

#include "problem/loose_points.hpp"

namespace perikit {

WeakSprings::WeakSprings(const Families& families, Problem& problem, double share)
    : families_(families),
      problem_(problem),
      share_(share),
      loose_(families.body().stride(), 0),
      anchor_(share > 0 ? problem.state().declare("weak_spring_anchor") : FieldView{}) {}

void WeakSprings::find(ConstFieldView u, bool fresh) {
  pieces_ = find_loose_pieces(families_, problem_.constraints(), problem_.images(), u);
  std::vector<std::uint8_t> now(loose_.size(), 0);
  for (const LoosePiece& piece : pieces_)
    for (const std::int32_t p : piece.points) {
      now[static_cast<std::size_t>(p)] = 1;
      if (!anchor_.data || !fresh || loose_[static_cast<std::size_t>(p)]) continue;
      for (int c = 0; c < u.components; ++c) anchor_.component(c)[p] = u.component(c)[p];
    }
  loose_ = std::move(now);
}

EvaluationStatus WeakSprings::refuse(ConstFieldView u) const {
  if (share_ > 0 || pieces_.empty() || !problem_.loads().any()) return {};
  const Body& body = families_.body();
  const LoosePiece* const driven = driven_piece(pieces_, body, u, problem_.state().external_force());
  if (!driven) return {};
  return {body.input_of(static_cast<std::size_t>(driven->points.front())), 0,
          fmt::format("nothing holds {}, and the loads move it ([run] weak_springs would hold it)", driven->name(body))};
}

double WeakSprings::stiffness(std::int32_t point) const {
  const auto p = static_cast<std::size_t>(point);
  const Moduli moduli = problem_.laws().moduli(p);
  const double dx = families_.body().spacing();
  return share_ * (moduli.lambda + 2 * moduli.mu) * families_.body().volume(p) / (dx * dx);
}

void WeakSprings::add_forces(ConstFieldView u, FieldView force, double* energy) const {
  for (const LoosePiece& piece : pieces_)
    for (const std::int32_t p : piece.points) {
      const double k = stiffness(p);
      for (int c = 0; c < u.components; ++c) {
        const double off = u.component(c)[p] - anchor_.component(c)[p];
        force.component(c)[p] -= k * off;
        if (energy) *energy += 0.5 * k * off * off;
      }
    }
}

void WeakSprings::add_tangent(ConstFieldView w, FieldView Kw) const {
  for (const LoosePiece& piece : pieces_)
    for (const std::int32_t p : piece.points)
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
