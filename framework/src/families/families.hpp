#pragma once
/// Who is in whose family, which bonds are whole, and what follows from both. One object a body: the problem owns it, and everything that
/// looks at bonds (spaces, penalties, pair laws, assembly, companion, fracture) borrows it.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "families/blocks.hpp"
#include "families/bonds.hpp"
#include "families/family_arrays.hpp"
#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"

namespace perikit {

class CloudFamilies;
class LatticeFamilies;

/// What is asked of families beyond their lists.
struct FamilyNeeds {
  bool influence = true;  ///< false: omega is 1 for every bond
  bool shapes = true;     ///< false: no shape tensors on clouds, and no fragments
};

/// Bonds of a point: of the body without pre-cracks; those that the set-up left, failed ones with b = 0; those with b > 0.
enum class BondsOf { uncut, set_up, intact };

class Families {
 public:
  /// Throws CoincidentPoints.
  static std::unique_ptr<Families> make(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs);
  virtual ~Families() = default;
  Families(const Families&) = delete;
  Families& operator=(const Families&) = delete;

  const Body& body() const noexcept { return body_; }
  const std::shared_ptr<const InfluenceFunction>& influence() const noexcept { return influence_; }
  const FamilyNeeds& needs() const noexcept { return needs_; }
  /// Of this kind, or null.
  virtual const LatticeFamilies* lattice() const noexcept { return nullptr; }
  virtual const CloudFamilies* cloud() const noexcept { return nullptr; }

  /// Bonds of a point in ascending order of their far ends, with K^-1 as it is now.
  virtual void load(std::size_t p, BondsOf which, FamilyArrays& out) const = 0;
  /// Points with equal families (uncut and as they are), class by class.
  virtual void each_class(const std::function<void(std::span<const std::int32_t> points)>& visit) const = 0;

  // By point.
  virtual double damage(std::size_t p) const noexcept = 0;      ///< D_i: lost share of the uncut family's influence
  virtual double remaining_influence(std::size_t p) const noexcept = 0;        ///< share of the influence at the set-up that is left
  virtual double condition(std::size_t p) const noexcept = 0;   ///< of K_i; infinite where singular
  virtual double normaliser(std::size_t p, BondWeight kind) const noexcept = 0;   ///< N_i over the uncut family: sum V_j or sum omega V_j
  /// Whether bonds of the point have failed or weakened since the set-up.
  virtual bool lost_bonds(std::size_t p) const noexcept = 0;

  // Bonds change here and nowhere else.
  virtual double integrity(BondId bond) const noexcept = 0;
  /// Lowers the integrity of bonds. Returns their ends, ascending.
  std::vector<std::int32_t> lower(std::span<const BondChange> changes);
  /// Takes back what was lowered: each of these bonds has the integrity that it had before. Returns their ends, ascending.
  std::vector<std::int32_t> raise(std::span<const BondChange> before);
  /// Every bond as it was at the set-up. Returns the points whose bonds had changed.
  std::vector<std::int32_t> mend();
  /// The bonds that are not as they were at the set-up, ascending.
  virtual std::vector<BondChange> changed() const = 0;
  /// The intact bonds of those of the points that are fragments, ascending, each once. None without shape tensors.
  std::vector<BondId> fragment_bonds(std::span<const std::int32_t> points) const;
  /// Another number whenever bonds have changed.
  std::size_t version() const noexcept { return version_; }
  /// Whether bonds have ever failed or may fail in this run.
  bool fails() const noexcept { return fails_; }
  /// Bonds may fail from now on: makes room for what that takes.
  void let_fail();
  /// Marks the points and everything in their families, whole or not; on lattices the groups of these.
  virtual void mark(std::span<const std::int32_t> points, GroupMarks& marks) const = 0;
  /// What a loop over evaluation points takes for these marks: on lattices whole groups.
  GroupMarks evaluated(GroupMarks marks) const;
  /// These points alone, as loops take them.
  GroupMarks marks_of(std::span<const std::int32_t> points) const;
  /// The marked points and everything in their families.
  GroupMarks around(const GroupMarks& marks) const;

  std::size_t bonds() const noexcept { return bonds_; }         ///< directed, of the set-up
  std::size_t cut() const noexcept { return cut_; }             ///< directed, by pre-cracks
  std::size_t singular() const noexcept { return singular_; }   ///< points without a gradient at the set-up
  virtual std::size_t bytes() const noexcept = 0;

 protected:
  Families(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs)
      : body_(body), influence_(std::move(influence)), needs_(needs) {}
  /// Their integrities, lower or higher than they were. Returns their ends, ascending.
  virtual std::vector<std::int32_t> set_bonds(std::span<const BondChange> changes) = 0;
  virtual std::vector<std::int32_t> mend_bonds() = 0;
  virtual void make_room() = 0;
  /// Whether bonds that failed have left the point with less than least_support of its uncut shape tensor.
  virtual bool is_fragment(std::size_t p) const noexcept = 0;

  const Body& body_;
  std::shared_ptr<const InfluenceFunction> influence_;
  FamilyNeeds needs_;
  std::size_t bonds_ = 0, cut_ = 0, singular_ = 0;

 private:
  std::size_t version_ = 0;
  bool fails_ = false;
};

/// w_ij of each bond of a loaded family, b V_j or b omega V_j over the normaliser of its point; padded.
void bond_shares(const Families& families, std::size_t p, BondWeight kind, const FamilyArrays& family, AlignedVector<double>& share);

/// D_i and the condition of K_i as fields.
Field damage_field(const Families& families);
Field condition_field(const Families& families);

}  // namespace perikit
