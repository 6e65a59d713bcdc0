#pragma once
/// One rank's share of a body. It owns some points; points of other ranks within two horizons of them are its ghosts. Every
/// evaluation point belongs to the rank of its owner: ghosts store no energy, and the forces that they receive belong to the rank
/// that owns them.

#include <cstdint>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

class Partition {
 public:
  /// Slabs of equal numbers of points across the longest side of the body.
  Partition(Body whole, int rank, int size);

  const Body& whole() const noexcept { return whole_; }
  /// The points that this rank owns, and its ghosts, whose material is number `ghost_material`. Sets hold owned points only.
  Body part(std::uint16_t ghost_material) const { return Body(whole_, owned_, kept_, ghost_material); }

  /// Input numbers of the whole body, by rank: points that rank k has as ghosts and this one owns, and the other way round.
  const std::vector<std::vector<std::int32_t>>& lent() const noexcept { return lent_; }
  const std::vector<std::vector<std::int32_t>>& borrowed() const noexcept { return borrowed_; }
  /// Input number in the whole body of the n-th kept point.
  std::int32_t input(std::size_t n) const noexcept { return inputs_[n]; }
  /// Place of a point among the kept ones, by its input number in the whole body; -1: not kept.
  std::int32_t place(std::int32_t input) const noexcept { return place_[static_cast<std::size_t>(input)]; }
  bool owns(std::int32_t input) const noexcept { return owned_[static_cast<std::size_t>(input)]; }

 private:
  Body whole_;
  std::vector<bool> owned_, kept_;                      ///< by input number
  std::vector<std::int32_t> inputs_, place_;
  std::vector<std::vector<std::int32_t>> lent_, borrowed_;
};

}  // namespace perikit
