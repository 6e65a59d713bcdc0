#pragma once
/// Bonds between neighbouring points, whose lengths tell how far a body has deformed.

#include <array>
#include <vector>

#include "families/families.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// On a lattice the bonds to the nearest points along the axes and the diagonals of squares; on clouds those of at most 1.5 spacings.
class NearBonds {
 public:
  /// `families` must outlive it.
  explicit NearBonds(const Families& families);
  /// Of intact bonds of the points that this rank owns, each counted once. u must hold the values of ghosts.
  StretchRange stretches(ConstFieldView u) const;
  std::size_t bytes() const noexcept { return (first_.size() + far_.size()) * sizeof(std::int32_t); }

 private:
  /// Squares of stretches.
  struct Squares {
    double least = 1, largest = 1;
  };
  template <int D>
  Squares on_lattice(ConstFieldView u) const;
  template <int D>
  Squares on_cloud(ConstFieldView u) const;
  /// Takes a bond in where it is intact and beyond what was found so far.
  void widen(Squares& range, double square, std::size_t p, std::size_t far) const;

  const Families& families_;
  bool all_intact_;   ///< bonds cannot fail, none is cut, and all points are this rank's
  std::vector<std::array<int, 3>> offsets_;     ///< lattices, internal axes
  std::vector<std::int32_t> first_, far_;       ///< clouds: by point, and the far ends
};

}  // namespace perikit
