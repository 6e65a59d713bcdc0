#pragma once
#include "families/bond_state.hpp"
#include "families/lattice_families.hpp"

namespace perikit {

/// Bonds of a lattice: bits in the patterns of its families.
class LatticeBonds final : public BondState {
 public:
  explicit LatticeBonds(LatticeFamilies& families) : families_(families) {}
  std::unique_ptr<BondMonitor> make_monitor(const BodyDamage& damage, bool skip) const override;
  std::vector<std::int32_t> lower(std::span<const BondChange> changes) override { return families_.break_bonds(changes); }
  std::vector<std::int32_t> mend() override { return families_.mend(); }
  void mark_families(std::span<const std::int32_t> points, GroupMarks& marks) const override;

 private:
  LatticeFamilies& families_;
};

}  // namespace perikit
