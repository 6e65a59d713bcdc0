#pragma once
/// The bonds of one run: finds those that fail, lowers them, and accounts for their energy.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "families/bond_monitor.hpp"
#include "families/families.hpp"
#include "families/gradual_failure.hpp"

namespace perikit {

class Fracture {
 public:
  /// known: see Families::make_monitor. All of them must outlive this.
  Fracture(Families& families, const BodyDamage& damage, bool skip, const NearestFailure* known);

  /// energy(u, marks): strain energy of the evaluation points of the marked groups; changed(points): what follows from the
  /// bonds of these points is to be computed anew. Bonds of fragments fail too, but for those that must not.
  using Energy = std::function<double(ConstFieldView, const GroupMarks&)>;
  using Changed = std::function<void(std::span<const std::int32_t>)>;
  BondUpdate update(ConstFieldView u, double time_step, const Motion& motion, const Energy& energy, const Changed& changed);

  /// Back to these bonds, which are those of `Families::changed` at another time.
  void restore(std::span<const BondChange> changes, const Changed& changed);
  BondChecks checks() const;
  std::size_t bytes() const noexcept { return monitor_->bytes(); }

 private:
  /// The bonds of fragments among the points that may fail.
  std::vector<BondId> fragments(std::span<const std::int32_t> points) const;

  Families& families_;
  const BodyDamage& damage_;
  std::unique_ptr<BondMonitor> monitor_;
  std::optional<GradualFailure> gradual_;
  std::size_t updates_ = 0;
  Field end_;                        ///< where failing bonds cease to act
};

}  // namespace perikit
