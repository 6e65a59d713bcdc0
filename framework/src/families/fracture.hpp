#pragma once
/// The bonds of one run: finds those that fail, lowers them, and accounts for their energy. On several ranks each decides the
/// same of the bonds that it holds, as it sees the same displacements and limits; fragments are found by the owners of their
/// points and told to all.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "families/bond_monitor.hpp"
#include "families/families.hpp"
#include "families/gradual_failure.hpp"
#include "families/shared_bonds.hpp"

namespace perikit {

class Fracture {
 public:
  /// known: see Families::make_monitor. All of them must outlive this.
  Fracture(Families& families, const BodyDamage& damage, bool skip, const NearestFailure* known);

  /// energy(u, marks): strain energy of the evaluation points of the marked groups; changed(points): what follows from the
  /// bonds of these points is to be computed anew. Bonds of fragments fail too, but for those that must not. All ranks must call
  /// it.
  using Energy = std::function<double(ConstFieldView, const GroupMarks&)>;
  using Changed = std::function<void(std::span<const std::int32_t>)>;
  BondUpdate update(ConstFieldView u, double time_step, const Motion& motion, const Energy& energy, const Changed& changed);

  /// Every bond that is not as it was at the set-up, by places in the whole body: on rank 0 those of all ranks. All ranks must
  /// call it.
  std::vector<BondChange> changed() const;
  /// Back to these bonds, which `changed` has named at another time. All ranks must call it.
  void restore(std::span<const BondChange> changes, const Changed& changed);
  /// Over all ranks, which must call it; bonds are counted once.
  BondChecks checks() const;
  std::size_t bytes() const noexcept { return monitor_->bytes(); }

 private:
  /// The bonds of fragments among the points that may fail. All ranks must call it.
  std::vector<BondId> fragments(std::span<const std::int32_t> points) const;

  Families& families_;
  const BodyDamage& damage_;
  SharedBonds shared_;
  std::unique_ptr<BondMonitor> monitor_;
  std::optional<GradualFailure> gradual_;
  std::size_t updates_ = 0;
  Field end_;  ///< where failing bonds cease to act
};

}  // namespace perikit
