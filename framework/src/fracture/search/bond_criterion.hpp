#pragma once
/// Finds the bonds that fail by more than their stretch: by their energy or their stress, which the terms are asked for.

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fracture/body_damage.hpp"
#include "fracture/bond_copies.hpp"
#include "fracture/search/bond_energy_split.hpp"
#include "fracture/search/bond_finder.hpp"
#include "fracture/search/bond_release.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// What a bond has of the stored energy.
struct BondEnergy {
  BondId bond;
  double energy = 0;  ///< [J]
};

class BondCriterion final : public BondFinder {
 public:
  /// Both must outlive this. asked: what is looked at, that of the criterion. damage: null for energies alone. Where the terms skip nothing it looks at every
  /// bond in every step, save for those that hold too little to fail by what they set free.
  BondCriterion(const Terms& terms, DamageTraits asked, const BodyDamage* damage);

  std::vector<BondChange> find(const Configuration& at) override;
  void values(std::span<const BondId> bonds, const Configuration& at, std::span<double> values) override;
  void forget() noexcept override {}
  std::size_t groups() const noexcept override { return groups_.size(); }
  std::size_t checked() const noexcept override { return checked_; }
  std::size_t bytes() const noexcept override {
    return samples_.bytes() + forces_.bytes() + 5 * own_.size() + near_.size() + (screen_.density.size() + screen_.of_bonds.size() + screen_.u.size()) * sizeof(double);
  }
  /// For evaluations of forces to mark the bonds that need a look; null where they cannot, or need not.
  BondScreen* screen() noexcept;
  /// Of all bonds, ascending: what they hold, or dE/db.
  std::vector<BondEnergy> energies(const Configuration& at);

 private:
  /// Arrays over the bonds of one point: those with a larger index, and those whose far ends are not looked at. Memory of one
  /// thread.
  struct Bonds {
    FamilyArrays family;
    std::vector<std::size_t> place;  ///< in the family
    AlignedVector<double> length, stretch, share, energy, stress, value, onset, failure, integrity;
    AlignedVector<double> all_shares;
    std::vector<BondCopies::Copy> copies;
    FamilyArrays of_copy;
  };

  void set_screen(std::span<const double> factors);
  bool looks_at(std::size_t p) const noexcept { return marked(own_, p) && marked(looked_at_, p); }
  GroupMarks near_failure(const Configuration& at);
  void name_near_failure();
  /// The named bonds, at their lower ends.
  void look_at_named();
  std::span<const BondId> named_in(std::int32_t first_group, std::int32_t last_group) const noexcept;
  /// Evaluates forces here, where the last evaluation was at other displacements, for the marks that they leave.
  void mark_by_forces(const Configuration& at);
  void clear_forces(int components);
  std::vector<std::int32_t> groups_with(const GroupMarks& marks) const;
  /// Visits the groups piece by piece, with the samples of a piece at hand: visit(groups of the piece).
  template <class Visit>
  void by_pieces(std::span<const std::int32_t> groups, const Configuration& at, Visit&& visit);
  GroupMarks looked_at(std::span<const std::int32_t> groups) const;
  void sample(std::span<const std::int32_t> groups, const Configuration& at);
  /// Where the flux that forces leave is all that a look at the bonds of these groups takes: that of the last forces if they were at u, else of forces
  /// about the groups. So what a bond sets free has the same bits whatever was evaluated before.
  void find_flux(std::span<const std::int32_t> groups, const Configuration& at);
  void collect(const Configuration& at, const GroupMarks& owners, const GroupMarks& kept);
  /// Bonds of the points of a group, as arrays in the memory of this thread: visit(p, bonds).
  template <class Visit>
  void bonds_of(std::int32_t group, ConstFieldView u, Visit&& visit);
  /// The bonds of p with their states and values; `named`: these alone.
  void load(std::int32_t p, ConstFieldView u, std::span<const BondId> named, Bonds& bonds) const;
  double energy_of(std::int32_t p, std::int32_t far, double b, double whole_omega) const noexcept;
  /// What the bond holds or sets free [J], by the terms; a copy of one with the integrity b.
  double energy_of_copy(const BondCopies::Copy& copy, double b, Bonds& bonds) const;
  void add_stress(std::int32_t owner, std::int32_t far, std::int32_t turned_by, double& weight, double* stress) const noexcept;
  /// Of a body with images: bond k of p stands for its copies, and what it holds is what all of them do.
  void take_copies(std::int32_t p, std::size_t k, ConstFieldView u, Bonds& bonds) const;
  /// Whether this rank looks at the bond for all of its copies.
  bool stands_for_copies(std::int32_t p, std::int32_t far, Bonds& bonds) const;

  const Families& families_;
  const Body& body_;
  const Formulation& formulation_;
  EnergyShares shares_;
  const BodyDamage* damage_;
  const BondCopies* copies_;  ///< null: the body has no images
  std::span<const std::unique_ptr<Term>> terms_;
  bool skip_;
  DamageTraits traits_;
  bool by_point_;  ///< evaluation points belong to points
  BondSamples samples_;
  std::optional<BondRelease> release_;  ///< where the criterion asks for what bonds set free
  PointFlux flux_;                      ///< what is sampled has this at its points; without data: it is sampled in full
  Field forces_;                        ///< that nobody reads
  std::vector<std::int32_t> groups_;  ///< with live points of this rank
  GroupMarks looked_at_;              ///< the points whose bonds are looked at
  std::vector<BondId> named_;         ///< ascending: of the bonds of these points those that are; empty: all
  GroupMarks sampled_;                ///< own_, and the copies of these points
  GroupMarks own_, near_;             ///< what was sampled last: points, and those at the far ends of bonds that are looked at
  std::vector<std::unique_ptr<Bonds>> memory_;  ///< by thread
  BondScreen screen_;
  std::size_t checked_ = 0;
  struct Found {
    BondChange change;
    double value;
  };
  void find_copies();
  std::vector<Found> found_;          ///< by the last `find`, ascending
  const double* found_at_ = nullptr;  ///< its displacement
};

/// What all bonds have of the stored energy, which adds up to it; not where laws have a history. released: dE/db_ij with displacements held; throws
/// std::logic_error for kinematics of which it is not known (see DamageTraits::released). Ascending.
std::vector<BondEnergy> bond_energies(const Terms& terms, const Configuration& at, bool released = false);

}  // namespace perikit
