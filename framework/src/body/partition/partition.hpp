#pragma once
/// One rank's share of a body. It owns whole blocks of points, and evaluates by itself all that its points feel: what lies within
/// reach of them and of their images is there too, its ghosts. Then forces of owned points are complete, and sums come in the order
/// that they have on one rank.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

class CloudImages;
class CloudShares;
class LatticeImages;
class LatticeShares;

class Partition {
 public:
  /// How far the force on a point depends on others: on evaluation points of points at most bonds - 1 bonds away, and the
  /// displacement of their families. blocks: evaluation takes points of a block together, so that blocks must be whole.
  struct Reach {
    int bonds = 2;
    bool blocks = false;
    bool sources = false;  ///< evaluation of an image asks for more of its source than the displacement
  };
  /// Of a lattice that no rank has as a whole: `inside` (empty: true) is asked at the cells that the rank is to have and no others.
  /// shares: what ranks own. images: of the points, where the lattice is one with images; it then says what is inside. All ranks
  /// must call it. Throws std::domain_error where the body has too few blocks for the ranks, where a part has more cells than indices
  /// can tell apart, and where an image lies on a point.
  Partition(const BodyFrame& frame, const Lattice& lattice, const LatticeShares& shares,
            const std::function<bool(const Point&)>& inside, const Reach& reach, const LatticeImages* images = nullptr);
  /// Of a cloud that no rank has as a whole. images: of its points, which are among the shares (null: none). All ranks must call it.
  /// Throws std::domain_error where the body has too few blocks for the ranks.
  Partition(const BodyFrame& frame, const CloudShares& shares, const Reach& reach, const CloudImages* images = nullptr);

  /// The points of this rank and its ghosts; far ones have the material number `far_material`. Once: it lets go of what it takes.
  /// All ranks must call it.
  Body make_part(std::uint16_t far_material);

  /// Internal indices of the part, by rank: points that rank k has as ghosts and this one owns, and the other way round.
  const std::vector<std::vector<std::int32_t>>& lent() const noexcept { return lent_; }
  const std::vector<std::vector<std::int32_t>>& borrowed() const noexcept { return borrowed_; }
  /// Points of each rank, without images.
  const std::vector<std::int64_t>& points() const noexcept { return points_; }
  /// Images of all ranks.
  std::size_t images() const noexcept { return images_; }

 private:
  void check_shares(std::size_t real) const;
  std::size_t owner(const Body& part, std::int32_t p) const;
  void exchange_borders(const Body& part);
  void exchange_numbers(Body& part) const;
  Body finished(Body part);

  std::size_t images_ = 0;
  BodyFrame frame_;
  Lattice lattice_;
  LatticePart lattice_part_;
  CloudPart cloud_part_;
  std::vector<std::uint16_t> owner_;  ///< of a lattice, by input number of the part
  std::vector<std::int64_t> points_;
  std::vector<std::vector<std::int32_t>> lent_, borrowed_;
};

}  // namespace perikit
