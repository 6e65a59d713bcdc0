#pragma once
/// One rank's share of a body. It owns whole blocks of points, and evaluates by itself all that its points feel: what lies within
/// reach of them and of their images is there too, its ghosts. Then forces of owned points are complete, and sums come in the order
/// that they have on one rank.

#include <cstdint>
#include <functional>
#include <optional>
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
  /// Of a body that each rank has as a whole, for which nobody has to ask others: what the parts below must be like, and what tests compare them
  /// with. All ranks of the communicator must call it with the same body; sources: of its images (images.hpp). Blocks hold points and
  /// images, and whoever owns a block has them. Throws std::domain_error where the body has too few blocks for the ranks.
  Partition(Body whole, const Reach& reach, std::vector<std::int32_t> sources = {});
  /// Of a lattice that no rank has as a whole: `inside` (empty: true) is asked at the cells that the rank is to have and no others.
  /// shares: what ranks own. images: of the points, where the lattice is one with images; it then says what is inside. All ranks
  /// must call it. Throws std::domain_error as above, where a part has more cells than indices can tell apart, and where an image
  /// lies on a point.
  Partition(const BodyFrame& frame, const Lattice& lattice, const LatticeShares& shares,
            const std::function<bool(const Point&)>& inside, const Reach& reach, const LatticeImages* images = nullptr);
  /// Of a cloud that no rank has as a whole. images: of its points, which are among the shares (null: none). All ranks must call it.
  /// Throws std::domain_error as above.
  Partition(const BodyFrame& frame, const CloudShares& shares, const Reach& reach, const CloudImages* images = nullptr);

  /// Null where no rank has it.
  const Body* whole() const noexcept { return whole_ ? &*whole_ : nullptr; }
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
  void refuse_idle(std::size_t real) const;
  void share_lattice(int size);
  void share_cloud(int size);
  void choose_images();
  void keep_cells(const Reach& reach);
  void keep_families(const Reach& reach);
  std::size_t owner(const Body& part, std::int32_t p) const;
  void exchange_borders(const Body& part);
  void exchange_numbers(Body& part) const;
  Body finished(Body part);

  /// visit(input number, input number of the source) of the images.
  template <class Visit>
  void over_images(Visit&& visit) const;

  std::optional<Body> whole_;
  std::vector<std::int32_t> sources_;
  std::size_t images_ = 0;
  BodyPart part_;    ///< of the whole body
  BodyFrame frame_;  ///< where there is none
  Lattice lattice_;
  LatticePart lattice_part_;
  CloudPart cloud_part_;
  std::vector<std::uint16_t> owner_;  ///< by input number of the whole body, else of the part of a lattice
  std::vector<std::int64_t> points_;
  std::vector<std::vector<std::int32_t>> lent_, borrowed_;
};

}  // namespace perikit
