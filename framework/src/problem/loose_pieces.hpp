#pragma once
/// Pieces of a body that nothing holds: without an answer in a quasi-static run.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "families/families.hpp"
#include "perikit/problem/constraints.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

/// Points that whole bonds join to each other and to no others, and the rigid motions that no constraint prevents.
struct LoosePiece {
  /// Translation along the axes, then turning in the planes xy, xz, yz, about `centre` and over `size`; of unit norm over the
  /// piece.
  using Motion = std::array<double, 6>;

  std::vector<std::int32_t> points;  ///< internal indices, ascending
  Point centre{};                    ///< [m], mean of the points where they are
  double size = 1;                   ///< [m]
  std::vector<Motion> motions;       ///< orthonormal

  /// Displacement of a motion at y.
  Point at(const Motion& motion, int dimension, const Point& y) const noexcept;
  /// "a piece of 12 points about (0.1, 0.2, 0)", "the body".
  std::string name(const Body& body) const;
};

/// All of them, in words; empty: none.
std::string names(const std::vector<LoosePiece>& pieces, const Body& body);

/// At the displacement u as the terms see it. images: null without. Of bodies on one rank.
std::vector<LoosePiece> find_loose_pieces(const Families& families, const Constraints& constraints, const ImageMap* images,
                                          ConstFieldView u);

/// The first piece that `force` [N] moves: its share along the free motions is more than rounding leaves of it.
const LoosePiece* driven_piece(const std::vector<LoosePiece>& pieces, const Body& body, ConstFieldView u, ConstFieldView force);

}  // namespace perikit
