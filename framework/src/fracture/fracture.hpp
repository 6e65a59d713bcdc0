#pragma once
/// The bonds of one run: finds those that fail, lowers them, and accounts for their energy and, in explicit steps, for the moment
/// inside of the step at which they failed. On several ranks each decides the same of the bonds that it holds, as it sees the
/// same displacements and limits; fragments are found by the owners of their points and told to all.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "families/families.hpp"
#include "fracture/aitken_acceleration.hpp"
#include "fracture/gradual_failure.hpp"
#include "fracture/search/bond_finder.hpp"
#include "fracture/shared_bonds.hpp"
#include "fracture/step_inside.hpp"

namespace perikit {

class Fracture {
 public:
  /// All of them must outlive this.
  Fracture(Families& families, const BodyDamage& damage, std::unique_ptr<BondFinder> finder);

  /// What it needs of those who know the forces. Marks: groups of points that depend on bonds that fail.
  struct Body {
    /// force += factor times the forces of the evaluation points of the marked groups and of some others, the same ones whatever the
    /// bonds are; without data nothing is added. Their energy, over all ranks; not a number, and nothing is added, where a point is inadmissible.
    std::function<double(const Configuration& at, const GroupMarks&, double factor, FieldView force)> forces;
    /// The energy alone, as `forces` has it.
    std::function<double(const Configuration& at, const GroupMarks&)> energy;
    /// Evaluation points depend on the bonds of the points that they belong to, and on no others: marks are those of the groups of
    /// points whose bonds change; else of everything in their families, too.
    bool owners_alone = false;
    /// What follows from the bonds of these points is to be computed anew.
    std::function<void(std::span<const std::int32_t> points)> changed;
  };
  /// After a step of this length [s]; 0 in later rounds of quasi-static ones. Bonds of fragments fail too, but for those that must not. All ranks must call it.
  BondUpdate update(const Configuration& at, double elapsed, const StepInside& step, const Body& body);

  // Of the bonds that weakened in the last update outside of a step, and have something left; on one rank.
  /// Whether some of them may be forecast.
  bool settling() const noexcept { return !settling_.empty(); }
  /// Whether others forecast how far they will weaken, by `weaken`; else updates do (AitkenAcceleration).
  void let_others_forecast(bool to_others) noexcept { forecasts_ = !to_others; }
  /// force += df/db (db/du . w), at the displacement of that update [N]. False where a point is inadmissible.
  bool add_weakening(const Configuration& at, ConstFieldView w, FieldView force, const Body& body);
  /// Those that may be forecast, as their falls form a series that ends (AitkenAcceleration), weaken to what they are at `forecast`, and not by more than half. Energies are those of `at`.
  BondUpdate weaken(const Configuration& at, ConstFieldView forecast, const Body& body);

  /// Back to these bonds, which Families::changed has named at another time. All ranks must call it.
  void restore(std::span<const BondChange> changes, const std::function<void(std::span<const std::int32_t>)>& changed);
  /// Over all ranks, which must call it; bonds are counted once.
  BondChecks checks() const;
  std::size_t bytes() const noexcept { return finder_->bytes(); }

 private:
  /// The bonds of fragments among the points that may fail. All ranks must call it.
  std::vector<BondId> fragments(std::span<const std::int32_t> points) const;
  /// A bond that a criterion has found, and when inside of the step it failed: from 0 at its beginning to 1 at its end.
  struct Found {
    BondChange change;
    double moment = 1;
    double excess = 1;  ///< its value over its limit, where it was found
  };
  /// Bonds of one excess, which fail together or stay together. All ranks have as many of them, the largest excess first.
  using Ties = std::vector<std::vector<BondChange>>;
  /// before: at the beginning of the explicit step that ends here; without data bonds fail here.
  std::vector<Found> found(std::span<const BondChange> changes, ConstFieldView before, const Configuration& at);
  /// Whether this rank knows what the criterion says of the bond, as no other one does.
  bool knows(BondId bond) const;
  /// The mean moment of these bonds of all ranks, which must call it; below 0: there are none.
  double mean_moment(std::span<const Found> found) const;
  /// All ranks must call it.
  Ties ties(std::span<const Found> found) const;
  GroupMarks dependent_on(std::span<const std::int32_t> ends, const Body& body) const;
  /// Lowers bonds, and those of fragments with them. at: where they fail; force += their forces there, where it has data. With the second law, those
  /// without which the energy does not rise: what was found is tried together, then in halves, those that exceed their limits most first, down to
  /// ties, which stay.
  void fail(std::span<const Found> found, const Configuration& at, FieldView force, const Body& body, BondUpdate& update);
  void try_to_fail(std::span<const std::vector<BondChange>> ties, const Configuration& at, const Body& body, std::vector<BondChange>& lawful,
                   std::vector<BondChange>& before, BondUpdate& update);
  /// account: what the energy at `at` falls by is dissipated.
  void lower(std::vector<BondChange> changes, const Configuration& at, FieldView force, bool account, const Body& body, BondUpdate& update);
  /// In the families alone; returns the ends. changes: those of fragments come after them; before: what the bonds had, in the order in which they fell.
  /// All ranks must call it.
  std::vector<std::int32_t> lower_with_fragments(std::vector<BondChange>& changes, std::vector<BondChange>& before);
  void take_back(std::span<const BondChange> before, const Body& body);
  void finish(BondUpdate& update);
  /// What the criterion leaves of these bonds here, whatever they had before.
  std::vector<double> integrities(std::span<const BondId> bonds, const Configuration& at);

  Families& families_;
  const BodyDamage& damage_;
  SharedBonds shared_;
  std::unique_ptr<BondFinder> finder_;
  std::optional<GradualFailure> gradual_;
  AitkenAcceleration hastened_;
  bool forecasts_ = true;
  std::vector<BondId> weakening_, settling_;  ///< by the last update outside of a step; those of them that may be forecast
  std::size_t updates_ = 0;
  Field before_, at_;  ///< displacement at the beginning of the step, and where bonds fail
  Field force_;        ///< of bonds that failed
  Field part_;         ///< of it, as long as nobody knows whether it is whole
};

}  // namespace perikit
