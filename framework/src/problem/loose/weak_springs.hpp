#pragma once
#include <string>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/problem/problem.hpp"
#include "problem/loose/loose_pieces.hpp"

namespace perikit {

/// What is done about the loose pieces of a body in a quasi-static run: their points hang on springs from where they came loose,
/// -k (u - anchor) with k = share (lambda + 2 mu) V/dx^2; with a share of 0 loads that move them are refused. All ranks
/// must call everything but add_tangent and add_to.
class WeakSprings {
 public:
  /// All must outlive this.
  WeakSprings(const Families& families, Problem& problem, Terms& terms, double share);

  /// Looks for the pieces at u, as the terms see it. fresh: points that are loose now and were not are anchored where they are.
  void find(ConstFieldView u, bool fresh);
  /// Whether there are any, on any rank.
  bool any() const noexcept { return any_; }
  /// All of them, in words; empty: none.
  std::string names() const;
  bool hold() const noexcept { return share_ > 0 && any_; }
  /// The piece that the present loads move although nothing holds it; all well where springs do. Of several
  /// ranks the one with its first point says it.
  EvaluationStatus refuse(ConstFieldView u) const;

  // Where they hold.
  void add_forces(ConstFieldView u, FieldView force, double* energy) const;
  void add_tangent(ConstFieldView w, FieldView Kw) const;
  void add_to(BlockMatrix& K) const;

 private:
  double stiffness(std::int32_t point) const;

  const Families& families_;
  Problem& problem_;
  Terms& terms_;
  double share_;
  std::vector<LoosePiece> pieces_;
  bool any_ = false;
  std::vector<std::int32_t> points_;     ///< of pieces, of this rank
  std::vector<std::uint8_t> loose_;      ///< by point
  FieldView anchor_;                 ///< in the state; no data without springs
};

}  // namespace perikit
