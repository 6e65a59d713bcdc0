#pragma once
/// The pieces into which a body falls: points that whole bonds join to each other and to no others. A body may lie on several ranks.

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "families/families.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

struct Piece {
  std::vector<std::int32_t> points;  ///< of this rank: internal indices, ascending
  std::int64_t first = 0;            ///< the lowest input number of its points, on whatever rank
  std::int64_t count = 0;            ///< of its points, on all ranks
  bool shared = false;               ///< whether it lies on several ranks
};

/// What images are of: by internal index their source and the signs of its components.
struct Sources {
  Sources(const Body& body, const ImageMap* images);
  std::vector<std::int32_t> source;  ///< -1: no image
  Field sign;                        ///< empty without images
};

/// An image, and a point that is bonded to it.
using BondedImage = std::pair<std::int32_t, std::int32_t>;

/// The pieces of which this rank has points; a bond to an image joins the point to the source of the image. bonded_images: where it is given, it gets
/// each image that a point of this rank is bonded to, with one of these points. All ranks must call it, and everything below.
std::vector<Piece> find_pieces(const Families& families, Problem& problem, const Sources& sources, std::vector<BondedImage>* bonded_images = nullptr);

/// Whether a comes first: the larger one, of equal ones that with the lowest point.
bool comes_before(const Piece& a, const Piece& b);
/// Whether this rank speaks for the piece: it has its first point.
bool speaks_for(const Piece& piece, const Body& body);

/// By internal index: the number of the piece that a point of this rank belongs to, from 1 in the order of comes_before. The same on any number of ranks.
Field piece_numbers(const Families& families, Problem& problem);

/// values, `width` of each piece, <- their sums over all ranks. pieces(k): the k-th of `count`.
void add_up_over_ranks(std::size_t count, const std::function<const Piece&(std::size_t)>& pieces, std::size_t width, std::span<double> values);

}  // namespace perikit
