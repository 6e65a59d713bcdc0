#pragma once
#include <utility>

#include "families/families.hpp"

namespace perikit {

/// Families of a cloud: lists of the bonds that the set-up left, their influence, and what point gradients and weights need of them.
class CloudFamilies final : public Families {
 public:
  CloudFamilies(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs);

  const CloudFamilies* cloud() const noexcept override { return this; }
  void load(std::size_t p, BondsOf which, FamilyArrays& out) const override;
  void each_class(const std::function<void(std::span<const std::int32_t>)>& visit) const override;
  double damage(std::size_t p) const noexcept override { return damage_[p]; }
  double remaining_influence(std::size_t p) const noexcept override { return left_.empty() ? 1.0 : left_[p]; }
  double condition(std::size_t p) const noexcept override { return condition_.empty() ? 0.0 : condition_[p]; }
  double normaliser(std::size_t p, BondWeight kind) const noexcept override { return kind == BondWeight::kernel ? influences_[p] : volumes_[p]; }
  bool lost_bonds(std::size_t p) const noexcept override;
  double integrity(BondId bond) const noexcept override;
  std::vector<BondChange> changed() const override;
  void mark(std::span<const std::int32_t> points, GroupMarks& marks) const override;
  std::size_t bytes() const noexcept override;

  // What loops over bonds read.
  const FamilyLists& lists() const noexcept { return lists_; }
  std::span<const std::int32_t> neighbours(std::size_t p) const noexcept {
    return {lists_.neighbour.data() + lists_.first[p], static_cast<std::size_t>(lists_.first[p + 1] - lists_.first[p])};
  }
  /// Place in the lists of the bond from `point` to `far`, which is one; of `point` itself: of its first bond to a larger index.
  std::int64_t index(std::int32_t point, std::int32_t far) const noexcept;
  const double* omegas() const noexcept { return omega_.data(); }   ///< the same; null where it is 1
  double omega(std::size_t bond) const noexcept { return omega_.empty() ? 1.0 : omega_[bond]; }                     ///< b omega
  double whole_omega(std::size_t bond) const noexcept { return whole_.empty() ? omega(bond) : whole_[bond]; }
  const double* whole_omegas() const noexcept { return whole_.empty() ? omega_.data() : whole_.data(); }             ///< null where it is 1
  double b(std::size_t bond) const noexcept { return integrity_.empty() ? 1.0 : integrity_[bond]; }
  const double* integrities() const noexcept { return integrity_.data(); }                                           ///< null where it is 1
  const double* inverse_shape(std::size_t p) const noexcept { return &inverse_[6 * p]; }                            ///< K^-1, 6 components

 private:
  /// Loops over all points or one whose bonds have changed.
  template <int D>
  void measure();
  template <int D>
  void renew(std::size_t p);
  /// Far ends, influence and integrity of a family that is not whole.
  void load_broken(std::size_t p, BondsOf which, FamilyArrays& out) const;
  /// Takes the bonds that are marked as cut out of the lists.
  void compact();
  std::vector<std::int32_t> set_bonds(std::span<const BondChange> changes) override;
  std::vector<std::int32_t> mend_bonds() override;
  void make_room() override;
  bool is_fragment(std::size_t p) const noexcept override { return !fragment_.empty() && fragment_[p]; }

  struct CutBond {
    std::int32_t point, far;
    double omega;
  };
  std::span<const CutBond> cut_bonds(std::size_t p) const noexcept;

  FamilyLists lists_;
  AlignedVector<double> omega_;       ///< by bond; empty where it is 1
  std::vector<CutBond> cuts_;         ///< by pre-cracks, ascending
  AlignedVector<double> inverse_, condition_;     ///< by point
  AlignedVector<double> volumes_, influences_;    ///< sum V_j and sum omega V_j of the uncut family
  AlignedVector<double> damage_;
  // Where bonds may fail: by bond, and by point.
  AlignedVector<double> integrity_, whole_;       ///< b; omega where it is not b omega
  AlignedVector<double> intact_, left_;           ///< sum omega V_j at the set-up, the share of it that is left
  std::vector<std::uint8_t> fragment_;            ///< is_fragment
};

}  // namespace perikit
