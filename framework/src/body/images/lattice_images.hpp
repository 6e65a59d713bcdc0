#pragma once
/// Images of the points of a lattice that no rank has as a whole: which of them lie in some cells follows from the cells of their
/// sources, which are asked for one by one.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "body/partition/lattice_shares.hpp"
#include "perikit/body/images.hpp"

namespace perikit {

class LatticeImages {
 public:
  using Cell = std::array<std::int64_t, 3>;
  struct OneImage {
    Cell cell, source;     ///< of the grown lattice
    std::int64_t number;   ///< after those of all points: ascending by sources in input order, of one source as they are made
  };
  /// points: the lattice without images; grown: with_images of it. inside: empty where all cells of `points` have a point. Planes are
  /// asked for the numbers of cells in the order of the input of `points`.
  LatticeImages(const Lattice& points, const Lattice& grown, Inside inside, ImageMaker maker);

  /// Whether a point of the body lies in a cell of the grown lattice.
  bool real(const Cell& cell) const;
  /// The cells of the grown lattice that may have one.
  const CellBox& box() const noexcept { return box_; }
  /// Those in a box, ascending by number, with all images of their sources, of which they are the k-th.
  void over(const CellBox& box, const std::function<void(const OneImage&, const Images& of_source, std::size_t k)>& visit) const;
  std::vector<OneImage> in(const CellBox& box) const;
  /// Cells of the images of a point of the body.
  std::vector<Cell> of(const Cell& source) const;
  /// The images that a part of the body has, by the numbers of the part; surfaces are still cells in the order of the input.
  Images of_part(const Body& part) const;
  std::vector<Crack> cracks(std::vector<Crack> of_body) const { return maker_.cracks(std::move(of_body)); }
  /// The cell of the grown lattice with a number of the order of the input of `points`.
  Cell grown_cell(std::int64_t number) const { return grown_.around(points_.centre(points_.cell_of_input(number))); }

 private:
  void make(const Cell& source, Images& images) const;

  Lattice points_, grown_;
  Inside inside_;
  ImageMaker maker_;
  CellBox box_;
  std::array<std::vector<std::vector<std::int64_t>>, 3> along_;  ///< by axis and coordinate in the box: of its images across it
  std::int64_t most_ = 1;                                        ///< images of a point
};

}  // namespace perikit
