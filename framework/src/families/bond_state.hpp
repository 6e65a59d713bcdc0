#pragma once
/// Which bonds of a body are still whole: the part of a model that damage changes.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "families/bond_monitor.hpp"

namespace perikit {

/// One bit by group of eight points (internal index / 8): where something has to be evaluated.
using GroupMarks = std::vector<std::uint8_t>;

class BondState {
 public:
  virtual ~BondState() = default;
  virtual std::unique_ptr<BondMonitor> make_monitor(const BodyDamage& damage, bool skip) const = 0;
  /// Lowers the integrity of bonds, in both directions. Returns the points at their ends, ascending.
  virtual std::vector<std::int32_t> lower(std::span<const BondChange> changes) = 0;
  /// Every bond as it was at the set-up. Returns the points whose bonds that changed.
  virtual std::vector<std::int32_t> mend() = 0;
  /// Marks the groups of the points and of everything in their families, whole or not.
  virtual void mark_families(std::span<const std::int32_t> points, GroupMarks& marks) const = 0;
};

/// The bonds of one run: finds those that fail, lowers them, and accounts for their energy.
class Fracture {
 public:
  Fracture(const Body& body, const BodyDamage& damage, BondState& state, bool skip)
      : body_(body), damage_(damage), state_(state), monitor_(state.make_monitor(damage, skip)) {}

  /// energy(u, marks): strain energy of the evaluation points of the marked groups; changed(points): what follows from the
  /// bonds of these points is to be computed anew; returns the bonds of fragments, in any order. They fail
  /// too, but for those that must not.
  using Energy = std::function<double(ConstFieldView, const GroupMarks&)>;
  using Changed = std::function<std::vector<BondChange>(std::span<const std::int32_t>)>;
  BondUpdate update(ConstFieldView u, const Motion& motion, const Energy& energy, const Changed& changed);

  /// The bonds that are not as they were at the set-up, for checkpoints.
  std::vector<BondChange> changes() const;
  /// Another number whenever bonds have changed.
  std::size_t version() const noexcept { return version_; }
  void restore(std::span<const BondChange> log, const Changed& changed);
  BondChecks checks() const;
  std::size_t bytes() const noexcept { return monitor_->bytes() + log_.size() * sizeof(BondChange); }

 private:
  void remember(std::span<const BondChange> changes);
  /// Those of the changes that may happen, each once, ascending.
  std::vector<BondChange> allowed(std::vector<BondChange> changes) const;

  const Body& body_;
  const BodyDamage& damage_;
  BondState& state_;
  std::unique_ptr<BondMonitor> monitor_;
  std::vector<BondChange> log_;      ///< every change in its order, now and then only the last one of each bond
  std::size_t compact_ = 0;          ///< entries that were left the last time
  std::size_t updates_ = 0, version_ = 0;
  Field end_;                        ///< where failing bonds cease to act
};

}  // namespace perikit
