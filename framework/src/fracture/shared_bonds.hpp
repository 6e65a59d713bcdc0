#pragma once
/// Bonds of a part of a body as all ranks name them: by the places of their ends in the whole body. Where one rank has the whole,
/// they keep their names.

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "families/bonds.hpp"
#include "families/families.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

/// The same as all ranks name it: by the places of its ends in the whole body.
struct NamedBond {
  std::int64_t point = 0, far = 0;
  friend auto operator<=>(const NamedBond&, const NamedBond&) = default;
};
struct NamedChange {
  NamedBond bond;
  double integrity = 0;
  friend bool operator<(const NamedChange& a, const NamedChange& b) { return a.bond < b.bond; }
};

class SharedBonds {
 public:
  /// `body` must outlive it.
  explicit SharedBonds(const Body& body) : body_(body) {}

  /// Of ascending changes those of bonds that no other rank owns, ascending.
  std::vector<NamedChange> outward(std::span<const BondChange> changes) const;
  /// Of changes in the whole body those with both ends here.
  std::vector<BondChange> inward(std::span<const NamedChange> changes) const;
  /// Of the bonds that any rank names those with both ends here, ascending. All ranks must call it.
  std::vector<BondId> of_all(std::span<const BondId> bonds) const;
  std::vector<BondChange> of_all(std::span<const BondChange> changes) const;
  /// Marks the groups of eight points that hold points of groups which any rank has marked. All ranks must call it.
  void mark(GroupMarks& marks) const;
  /// Marks by point: the points of all ranks that are here, and those that share a group of eight points of the whole body with them: the same
  /// points on any number of ranks. Empty where no rank has any. All ranks must call it.
  std::vector<std::uint8_t> points_beside(std::span<const std::int32_t> points) const;
  /// Whether other ranks have bonds, too.
  bool part() const noexcept { return body_.part(); }

 private:
  std::int64_t place(std::int32_t p) const noexcept { return part() ? body_.places().place[static_cast<std::size_t>(p)] : p; }
  NamedChange named(const BondChange& change) const noexcept;
  std::vector<NamedChange> merged(std::span<const BondChange> mine) const;

  const Body& body_;
};

}  // namespace perikit
