#pragma once
/// Finds the bonds that fail by their stretch without looking at all of them in every step, and yet at the very step where they
/// fail.
///
/// A group of eight points knows its margin: how much more the nearest of its bonds could take when it was last checked. A bound of what the
/// bonds around it have changed since a reference displacement, now and at that check, tells when it must be looked at again:
///   change since the check <= change since the reference + change from the reference to the check.
/// The reference is renewed, with a check of everything, once the single checks since the last one add up to as much work. Where the loop over
/// forces knows how far bonds are from failing, none of this is needed.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "families/bonds.hpp"
#include "fracture/search/bond_finder.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

struct BodyDamage;
class CloudFamilies;
class LatticeFamilies;
struct NearestFailure;

class BondMonitor : public BondFinder {
 public:
  std::vector<BondChange> find(const Configuration& at) override;
  void values(std::span<const BondId> bonds, const Configuration& at, std::span<double> values) override;
  void forget() noexcept override { renew_ = true; }
  std::size_t groups() const noexcept override { return groups_.size(); }
  std::size_t checked() const noexcept override { return checked_; }
  std::size_t bytes() const noexcept override;

 protected:
  /// Points first ... first + 7, those of the mask.
  struct Group {
    std::int32_t first;
    std::uint8_t live;
    std::int32_t item;           ///< whatever the derived class finds them by
  };
  /// skip = false: every group in every step, for comparison.
  BondMonitor(const Body& body, bool skip) : body_(body), skip_(skip), reference_(body.make_field(body.dimension())) {}
  /// Groups cell by cell; cell_first has one more entry than there are cells.
  void set_cells(std::vector<Group> groups, std::vector<std::size_t> cell_first);
  /// Before everything else in each call of `find`: whether `near_failure` knows of every group at u.
  virtual bool begin(ConstFieldView) { return false; }
  /// False where no bond of the group can be beyond its onset.
  virtual bool near_failure(const Group&) const noexcept { return true; }
  /// moved[c]: a bound of the change of the bonds of cell c from reference_ to u, in the units of the margins.
  virtual void bound_motion(ConstFieldView u, std::span<double> moved) = 0;
  /// Appends the bonds of the group that fail; returns the least margin of its other ones.
  virtual double check(const Group& group, ConstFieldView u, std::vector<BondChange>& changes) = 0;

  std::size_t cells() const noexcept { return cell_first_.size() - 1; }
  std::span<const Group> groups_of(std::size_t cell) const noexcept {
    return {groups_.data() + cell_first_[cell], cell_first_[cell + 1] - cell_first_[cell]};
  }
  template <class Visit>
  void over_cells(Visit&& visit) const;

  const Body& body_;
  bool skip_;
  Field reference_;                                 ///< displacement

 private:
  std::vector<Group> groups_;
  std::vector<std::size_t> cell_first_;
  std::vector<double> margin_;                      ///< by group
  std::vector<double> offset_;                      ///< by group: bound from the reference to its last check
  std::vector<double> moved_;                       ///< by cell
  bool renew_ = true;                               ///< everything is to be checked
  std::size_t since_ = 0;                           ///< checks since everything was
  std::vector<std::vector<BondChange>> found_;      ///< by cell
  std::vector<std::size_t> checks_;                 ///< by cell, of one call
  std::size_t checked_ = 0;
};

std::unique_ptr<BondFinder> make_lattice_monitor(const LatticeFamilies& families, const BodyDamage& damage, bool skip);
/// known: what a loop over forces leaves behind; null: nothing.
std::unique_ptr<BondFinder> make_cloud_monitor(const CloudFamilies& families, const BodyDamage& damage, bool skip, const NearestFailure* known);

template <class Visit>
void BondMonitor::over_cells(Visit&& visit) const {
  constexpr std::size_t batch = 16;   // cells a task
  const std::size_t n = cells();
  parallel_for((n + batch - 1) / batch, [&](std::size_t b) {
    for (std::size_t c = b * batch; c < std::min(n, (b + 1) * batch); ++c) visit(c);
  });
}

}  // namespace perikit
