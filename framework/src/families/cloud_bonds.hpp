#pragma once
#include "families/bond_state.hpp"
#include "families/cloud_rows.hpp"

namespace perikit {

/// What a force loop that knows the stretch of every bond leaves behind, so that bonds far from failing are not looked at a second time.
struct NearestFailure {
  double least_onset = 0;              ///< of the body; set by the monitor
  AlignedVector<double> excess;        ///< by point: largest e - least_onset |xi| of its bonds to larger indices [m]
  const AlignedVector<Row>* u = nullptr;   ///< displacement of that evaluation, point-major; null: unknown
};

/// Bonds of a cloud: one number by directed bond.
class CloudBonds final : public BondState {
 public:
  CloudBonds(const Body& body, const FamilyLists& lists) : body_(body), lists_(lists), integrity_(lists.neighbour.size(), 1.0) {}

  double operator[](std::size_t bond) const noexcept { return integrity_[bond]; }
  /// Of the bond from `point` to `far`, which is one.
  std::int64_t index(std::int32_t point, std::int32_t far) const noexcept;
  std::unique_ptr<BondMonitor> make_monitor(const BodyDamage& damage, bool skip) const override;
  std::vector<std::int32_t> lower(std::span<const BondChange> changes) override;
  std::vector<std::int32_t> mend() override;
  void mark_families(std::span<const std::int32_t> points, GroupMarks& marks) const override;
  std::size_t bytes() const noexcept { return (integrity_.size() + nearest_.excess.size()) * sizeof(double); }
  NearestFailure& nearest() const noexcept { return nearest_; }

 private:
  const Body& body_;
  const FamilyLists& lists_;
  AlignedVector<double> integrity_;
  mutable NearestFailure nearest_;
};

}  // namespace perikit
