#pragma once
/// Pieces of a body that nothing holds: without an answer in a quasi-static run.

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "problem/loose/pieces.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// A piece with the rigid motions that no constraint prevents.
struct LoosePiece : Piece {
  /// Translation along the axes, then turning in the planes xy, xz, yz, about `centre` and over `size`; of unit norm over the
  /// piece.
  using Motion = std::array<double, 6>;

  explicit LoosePiece(Piece piece) : Piece(std::move(piece)) {}

  Point centre{};                    ///< [m], mean of the points where they are
  double size = 1;                   ///< [m]
  std::vector<Motion> motions;       ///< orthonormal

  /// Displacement of a motion at y.
  Point at(const Motion& motion, int dimension, const Point& y) const noexcept;
  /// "a piece of 12 points about (0.1, 0.2, 0)", "the body".
  std::string name(const Body& body) const;
};

/// All of them, on whatever rank, in words; empty: none. All ranks must call it, and everything below.
std::string names(const std::vector<LoosePiece>& pieces, const Body& body);

/// Those of which this rank has points, the largest first, at the displacement u as the terms see it. Terms that act on points hold them
/// where they resist a motion, now or at the end of the run.
std::vector<LoosePiece> find_loose_pieces(const Families& families, Problem& problem, Terms& terms, ConstFieldView u);

/// The first piece of all that `force` [N] moves: its share along the free motions is more than rounding leaves of it. Null on ranks
/// that have not its first point.
const LoosePiece* driven_piece(const std::vector<LoosePiece>& pieces, const Body& body, ConstFieldView u, ConstFieldView force);

}  // namespace perikit
