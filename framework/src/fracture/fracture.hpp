#pragma once
/// The bonds of one run that may fail: finds those that do, lowers them, and accounts for their energy and, in explicit steps, for the moment
/// inside of the step at which they failed. On several ranks each decides the same of the bonds that it holds, as it sees the
/// same displacements and limits; fragments are found by the owners of their points and told to all.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "families/families.hpp"
#include "fracture/aitken_acceleration.hpp"
#include "fracture/body_damage.hpp"
#include "fracture/gradual_failure.hpp"
#include "fracture/search/bond_finder.hpp"
#include "fracture/shared_bonds.hpp"
#include "terms/term.hpp"

namespace perikit {

class Terms;

struct BondUpdate {
  std::size_t changed = 0;  ///< bonds, each once
  double dissipated = 0;    ///< strain energy before less after, at the displacement where they failed [J]
  std::vector<std::int32_t> ends = {};  ///< points whose bonds have changed, some of them more than once
  std::size_t held = 0;     ///< bonds that stay as they are, as their failure would have raised the energy
  int inside_out = 0;       ///< times that a point was inadmissible where bonds failed: no energy and no impulse is taken of them
};

/// What bonds that failed inside of an explicit step owe: their forces act so much longer, where and when they failed.
struct BondImpulse {
  FieldView force;       ///< of the bonds [N], to be overwritten; without data they owe nothing
  double time = 0;       ///< [s]; less than 0: they acted too long
  double moment = 0;     ///< of the step, from 0 at its beginning to 1 at its end
  /// An impulse works at the velocity of its moment, and in the balance of a step at that of the end of the step that it belongs to: with this factor, the growth
  /// of the power of its forces without the bonds [W/s] is energy that is not dissipated [s^2].
  double lag = 0;
};

/// How the checks went: what the conservative skip saved.
struct BondChecks {
  std::size_t updates = 0;          ///< calls of Fracture::find
  std::size_t groups = 0;           ///< groups of eight points that could have been checked, summed over updates
  std::size_t checked = 0;          ///< groups that were
  std::size_t failed = 0;           ///< bonds broken by now, each once
  std::size_t weakened = 0;         ///< bonds between whole and broken
};

/// Of all updates so far; run state.
struct BondAccount {
  std::int64_t gains = 0;       ///< updates that raised the strain energy
  double gained = 0;            ///< what they added [J]
  std::int64_t inside_out = 0;  ///< see BondUpdate
  std::int64_t held = 0;        ///< likewise
};

/// Points whose gradients may have become stiffer, and the evaluation points that act on them.
struct StiffenedPoints {
  std::vector<std::uint8_t> inside;  ///< by point; empty: none on any rank
  MarkedRegion region;
};

class Fracture {
 public:
  /// Bonds of `terms`, which must outlive this, may fail from now on.
  Fracture(Terms& terms, std::unique_ptr<const BodyDamage> damage);
  ~Fracture();

  const BodyDamage& damage() const noexcept { return *damage_; }
  const Families& families() const noexcept { return families_; }

  // Bonds change here and nowhere else. All ranks must call what follows. Displacements are as the terms see them.
  /// Lets bonds fail or weaken that are beyond their limits at an equilibrium, after a step of this length [s]; 0 in later rounds of the same step. Bonds of
  /// fragments fail too, but for those that must not.
  BondUpdate update(const Configuration& at, double elapsed);

  // The same inside of an explicit step: `find`; where that is true `fail` for its early half and for its late one, and `finish`.
  /// Looks for bonds that are beyond their limits at the end of a step of this length [s]. True where some rank has found one.
  bool find(const Configuration& end, double elapsed);
  /// Those of one half of the step fail at the mean of their moments, and where the body was then: on the line from `before`, the displacements at the
  /// beginning of the step, to `end`.
  BondImpulse fail(bool early, ConstFieldView before, const Configuration& end, double elapsed, BondUpdate& update);
  void finish(BondUpdate& update);

  // Of the bonds that weakened in the last update outside of a step, and have something left; on one rank.
  /// Whether some of them may be forecast.
  bool settling() const noexcept { return !settling_.empty(); }
  /// Whether others forecast how far they will weaken, by `weaken`; else updates do (AitkenAcceleration).
  void let_others_forecast(bool to_others) noexcept { forecasts_ = !to_others; }
  /// force += df/db (db/du . w), at the displacement of that update [N]. False where a point is inadmissible.
  bool add_weakening(const Configuration& at, ConstFieldView w, FieldView force);
  /// Those that may be forecast, as their falls form a series that ends (AitkenAcceleration), weaken to what they are at `forecast`, and not by more than half.
  /// Energies are those of `at`.
  BondUpdate weaken(const Configuration& at, ConstFieldView forecast);

  /// Back to these bonds, which Families::changed has named at another time.
  void restore(std::span<const BondChange> changes);
  /// Where the last update may have made the body stiffer: around the bonds that it changed, but for points whose families are left with so much
  /// that their gradients are no stiffer than before. On any number of ranks the same points.
  StiffenedPoints stiffened_points() const;

  /// Bonds are counted once.
  BondChecks checks() const;
  BondAccount& account() noexcept { return account_; }
  const BondAccount& account() const noexcept { return account_; }
  /// How bonds failed so far, in words. dissipated: by them, in all [J].
  std::string summary(double dissipated) const;
  /// Adds bytes and warnings.
  void report(ModelReport& report) const;

 private:
  /// A bond that a criterion has found, and when inside of the step it failed: from 0 at its beginning to 1 at its end.
  struct Found {
    BondChange change;
    double moment = 1;
    double excess = 1;  ///< its value over its limit, where it was found
  };
  /// Bonds of one excess, which fail together or stay together. All ranks have as many of them, the largest excess first.
  using Ties = std::vector<std::vector<BondChange>>;
  /// The bonds of fragments among the points that may fail. All ranks must call it.
  std::vector<BondId> fragments(std::span<const std::int32_t> points) const;
  /// Of changes_. before: at the beginning of the explicit step that ends here; without data bonds fail here.
  std::vector<Found> found(ConstFieldView before, const Configuration& at);
  /// Whether this rank knows what the criterion says of the bond, as no other one does.
  bool knows(BondId bond) const;
  /// The mean moment of these bonds of all ranks, which must call it; below 0: there are none.
  double mean_moment(std::span<const Found> found) const;
  /// All ranks must call it.
  Ties ties(std::span<const Found> found) const;
  /// The evaluation points that depend on the bonds of these points; on all ranks the same.
  MarkedRegion dependent_on(std::span<const std::int32_t> ends) const;
  /// What follows from the bonds of these points is computed anew.
  void bonds_changed(std::span<const std::int32_t> points);
  /// Lowers bonds, and those of fragments with them. at: where they fail; force += their forces there, where it has data. With the second law, those
  /// without which the energy does not rise: what was found is tried together, then in halves, those that exceed their limits most first, down to
  /// ties, which stay.
  void let_fail(std::span<const Found> found, const Configuration& at, FieldView force, BondUpdate& update);
  void try_to_fail(std::span<const std::vector<BondChange>> ties, const Configuration& at, std::vector<BondChange>& lawful, std::vector<BondChange>& before,
                   BondUpdate& update);
  /// account: what the energy at `at` falls by is dissipated.
  void lower(std::vector<BondChange> changes, const Configuration& at, FieldView force, bool account, BondUpdate& update);
  /// In the families alone; returns the ends. changes: those of fragments come after them; before: what the bonds had, in the order in which they fell.
  /// All ranks must call it.
  std::vector<std::int32_t> lower_with_fragments(std::vector<BondChange>& changes, std::vector<BondChange>& before);
  void take_back(std::span<const BondChange> before);
  /// What the criterion leaves of these bonds here, whatever they had before.
  std::vector<double> integrities(std::span<const BondId> bonds, const Configuration& at);

  Terms& terms_;
  std::unique_ptr<const BodyDamage> damage_;
  Families& families_;
  std::vector<BreakableTerm*> breakable_;
  SharedBonds shared_;
  std::unique_ptr<BondFinder> finder_;
  std::optional<GradualFailure> gradual_;
  AitkenAcceleration hastened_;
  bool forecasts_ = true;
  std::vector<BondId> weakening_, settling_;  ///< by the last update outside of a step; those of them that may be forecast
  BondAccount account_;
  std::size_t updates_ = 0;
  std::vector<BondChange> changes_;  ///< what was found last
  std::vector<Found> inside_;        ///< the same with their moments inside of the step
  std::vector<std::int32_t> ends_;   ///< of bonds that changed in the last update
  Field at_;                         ///< displacement where bonds fail inside of a step
  Field force_;                      ///< of bonds that failed there
  Field part_;                       ///< of it, as long as nobody knows whether it is whole
};

}  // namespace perikit
