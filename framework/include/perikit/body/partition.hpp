#pragma once
/// One rank's share of a body. It owns whole blocks of points, and evaluates by itself all that its points feel: what lies within
/// reach of them and of their images is there too, its ghosts. Then forces of owned points are complete, and sums come in the order
/// that they have on one rank.

#include <cstdint>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

class Partition {
 public:
  /// How far the force on a point depends on others: on evaluation points of points at most bonds - 1 bonds away, and the
  /// displacement of their families. blocks: evaluation takes points of a block together, so that blocks must be whole.
  struct Reach {
    int bonds = 2;
    bool blocks = false;
    bool sources = false;  ///< evaluation of an image asks for more of its source than the displacement
  };
  /// All ranks of the communicator must call it with the same body; sources: of its images (images.hpp). Blocks hold points and
  /// images, and whoever owns a block has them. Throws std::domain_error where the body has too few blocks for the ranks.
  Partition(Body whole, const Reach& reach, std::vector<std::int32_t> sources = {});

  const Body& whole() const noexcept { return whole_; }
  /// The points of this rank and its ghosts; far ones have the material number `far_material`. Once: it lets go of what it takes.
  Body make_part(std::uint16_t far_material);

  /// Input numbers of the whole body, by rank: points that rank k has as ghosts and this one owns, and the other way round.
  const std::vector<std::vector<std::int32_t>>& lent() const noexcept { return lent_; }
  const std::vector<std::vector<std::int32_t>>& borrowed() const noexcept { return borrowed_; }
  /// By input number: the rank that owns the point or image.
  std::span<const std::uint16_t> owners() const noexcept { return owner_; }
  /// Points of each rank, without images.
  const std::vector<std::int64_t>& points() const noexcept { return points_; }

 private:
  void share_lattice(int size);
  void share_cloud(int size);
  void choose_images();
  void keep_cells(const Reach& reach);
  void keep_families(const Reach& reach);
  void exchange_borders();

  /// visit(input number, input number of the source) of the images.
  template <class Visit>
  void over_images(Visit&& visit) const;

  Body whole_;
  std::vector<std::int32_t> sources_;
  BodyPart part_;
  std::vector<std::uint16_t> owner_;
  std::vector<std::int64_t> points_;
  std::vector<std::vector<std::int32_t>> lent_, borrowed_;
};

}  // namespace perikit
