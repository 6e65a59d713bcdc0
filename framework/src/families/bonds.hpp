#pragma once
/// How bonds are named.

#include <compare>
#include <cstdint>

namespace perikit {

/// A bond is named by its ends, internal indices with point < far: one name for both directions, on lattices and clouds.
struct BondId {
  std::int32_t point = 0, far = 0;
  static BondId of(std::int32_t p, std::int32_t q) noexcept { return p < q ? BondId{p, q} : BondId{q, p}; }
  friend auto operator<=>(const BondId&, const BondId&) = default;
};

/// A bond whose integrity fell.
struct BondChange {
  BondId bond;
  double integrity = 0;
};

}  // namespace perikit
