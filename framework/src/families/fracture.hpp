#pragma once
/// The bonds of one run: finds those that fail, lowers them, and accounts for their energy and, in explicit steps, for the moment
/// inside of the step at which they failed. On several ranks each decides the same of the bonds that it holds, as it sees the
/// same displacements and limits; fragments are found by the owners of their points and told to all.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "families/bond_finder.hpp"
#include "families/families.hpp"
#include "families/gradual_failure.hpp"
#include "families/hastened_bonds.hpp"
#include "families/shared_bonds.hpp"

namespace perikit {

class Fracture {
 public:
  /// All of them must outlive this.
  Fracture(Families& families, const BodyDamage& damage, std::unique_ptr<BondFinder> finder);

  /// What it needs of those who know the forces. Marks: groups of points that depend on bonds that fail.
  struct Body {
    /// force += factor times the forces of the evaluation points of the marked groups and of some others, the same ones whatever the
    /// bonds are; without data nothing is added. Their energy, over all ranks; not a number, and nothing is added, where a point is inadmissible.
    std::function<double(ConstFieldView u, const GroupMarks&, double factor, FieldView force)> forces;
    /// The energy alone, as `forces` has it.
    std::function<double(ConstFieldView u, const GroupMarks&)> energy;
    /// Evaluation points depend on the bonds of the points that they belong to, and on no others: marks are those of the groups of
    /// points whose bonds change; else of everything in their families, too.
    bool owners_alone = false;
    /// What follows from the bonds of these points is to be computed anew.
    std::function<void(std::span<const std::int32_t> points)> changed;
  };
  /// Bonds of fragments fail too, but for those that must not. begin, reaction: see Terms::update_bonds. All ranks must call it.
  BondUpdate update(ConstFieldView u, double time_step, const StepBegin& begin, BondReaction* reaction, const Body& body);

  // Of the bonds that weakened in the last update outside of a step, and have something left; on one rank.
  /// Whether some of them may be forecast.
  bool settling() const noexcept { return !settling_.empty(); }
  /// Whether others forecast how far they will weaken, by `weaken`; else updates do (HastenedBonds).
  void leave_forecasts(bool to_others) noexcept { forecasts_ = !to_others; }
  /// force += df/db (db/du . w) at u, the displacement of that update [N]. False where a point is inadmissible.
  bool add_weakening(ConstFieldView u, ConstFieldView w, FieldView force, const Body& body);
  /// Those that may be forecast, as their falls form a series that ends (HastenedBonds), weaken to what they are at `forecast`, and not by more than half. Energies are those at u.
  BondUpdate weaken(ConstFieldView u, ConstFieldView forecast, const Body& body);

  /// Back to these bonds, which Families::changed has named at another time. All ranks must call it.
  void restore(std::span<const BondChange> changes, const std::function<void(std::span<const std::int32_t>)>& changed);
  /// Over all ranks, which must call it; bonds are counted once.
  BondChecks checks() const;
  std::size_t bytes() const noexcept { return finder_->bytes(); }

 private:
  /// The bonds of fragments among the points that may fail. All ranks must call it.
  std::vector<BondId> fragments(std::span<const std::int32_t> points) const;
  /// The moments at which these bonds failed, from 0 at the beginning of the step, at `before`, to 1 at its end, at u; -1: they
  /// stay this time.
  std::vector<double> moments(std::span<const BondChange> changes, ConstFieldView before, ConstFieldView u);
  GroupMarks dependent_on(std::span<const std::int32_t> ends, const Body& body) const;
  GroupMarks widened(GroupMarks marks, std::span<const std::int32_t> ends) const;
  /// Lowers bonds, and those of fragments with them. at: where they fail; impulse += owed times their forces there. With the
  /// second law, those without which the energy does not rise: what was found is tried together, then in halves, down to single
  /// bonds, which stay.
  void fail(std::vector<BondChange> changes, ConstFieldView at, double owed, FieldView impulse, const Body& body, BondUpdate& update);
  void lower(std::vector<BondChange> changes, ConstFieldView at, double owed, FieldView impulse, const Body& body,
             BondUpdate& update);
  void try_to_fail(std::vector<BondChange> changes, ConstFieldView at, const Body& body, std::vector<BondChange>& lawful,
                   std::vector<BondChange>& before, BondUpdate& update);
  void take_back(std::vector<BondChange>& before, const Body& body);
  std::vector<BondChange> later_half(std::vector<BondChange>& changes) const;
  void finish(BondUpdate& update);
  /// What the criterion leaves of these bonds at u, whatever they had before.
  std::vector<double> integrities(std::span<const BondId> bonds, ConstFieldView u);

  Families& families_;
  const BodyDamage& damage_;
  SharedBonds shared_;
  std::unique_ptr<BondFinder> finder_;
  std::optional<GradualFailure> gradual_;
  HastenedBonds hastened_;
  bool forecasts_ = true;
  std::vector<BondId> weakening_, settling_;  ///< by the last update outside of a step; those of them that may be forecast
  std::size_t updates_ = 0;
  Field before_, at_;  ///< displacement at the beginning of the step, and where bonds fail
  Field part_;         ///< of an impulse, as long as nobody knows whether it is whole
};

}  // namespace perikit
