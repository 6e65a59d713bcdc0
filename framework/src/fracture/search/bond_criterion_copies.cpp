// Bonds of bodies with images: the first of its copies stands for a bond (fracture/bond_copies.hpp).
#include <algorithm>
#include <utility>

#include "core/each_once.hpp"
#include "families/bond_stretch.hpp"
#include "fracture/search/bond_criterion.hpp"

namespace perikit {

bool BondCriterion::stands_for_copies(std::int32_t p, std::int32_t far, Bonds& m) const {
  copies_->find(p, far, m.copies);
  return BondCopies::first(m.copies).bond() == BondId::of(p, far) && copies_->decides(m.copies);
}

double BondCriterion::energy_of_copy(const BondCopies::Copy& copy, double b, Bonds& m) const {
  if (release_) return release_->of(copy.point, copy.far) + release_->of(copy.far, copy.point);
  double omega = 0;   // behind curved surfaces copies have other lengths
  if (by_point_) {
    families_.load(static_cast<std::size_t>(copy.point), BondsOf::intact, m.of_copy);
    const auto at = std::ranges::lower_bound(m.of_copy.far, copy.far);
    omega = m.of_copy.whole_omega(static_cast<std::size_t>(at - m.of_copy.far.begin()));
  }
  return energy_of(copy.point, copy.far, b, omega) * body_.volume(static_cast<std::size_t>(copy.point)) * body_.volume(static_cast<std::size_t>(copy.far));
}

/// The body stores the energies of evaluation points that belong to points of its own. Both directions of a bond, which has two, are found among
/// its copies: the one between p and the image of q has one of them, that between q and the image of p the other. A bond between a point and its own
/// image is the only one of its copies, and has one.
void BondCriterion::take_copies(std::int32_t p, std::size_t k, ConstFieldView u, Bonds& m) const {
  std::int32_t here = p, far = m.family.far[m.place[k]];
  if (copies_->image(here)) std::swap(here, far);
  copies_->find(here, far, m.copies);
  const int most_ends = BondCopies::first(m.copies).real_ends;
  if (m.copies.size() == 1 && most_ends == 2) return;
  const double b = m.family.b(m.place[k]);
  double energy = 0, volumes = 0, weight = 0, stress[6] = {};
  double stretch = -1;
  for (const BondCopies::Copy& copy : m.copies) {
    if (families_.integrity(copy.bond()) == 0) continue;
    if (traits_.energy) energy += energy_of_copy(copy, b, m);
    volumes += copy.real_ends * body_.volume(static_cast<std::size_t>(copy.point)) * body_.volume(static_cast<std::size_t>(copy.far));
    if (copy.real_ends < most_ends) continue;
    // Behind a held face one of two copies may be shorter than at rest.
    stretch = std::max(stretch, bond_stretch(body_, u, copy.bond()));
    for (const auto& [owner, other] : {std::pair(copy.point, copy.far), std::pair(copy.far, copy.point)})
      if (traits_.stress && !copies_->image(owner)) add_stress(owner, other, copy.point, weight, stress);
    // The other direction of a bond between a point and its own image is the mirror of the one that is there.
    if (traits_.stress && m.copies.size() == 1) add_stress(copy.point, copy.far, copy.far, weight, stress);
  }
  m.stretch[k] = stretch;
  if (traits_.energy) m.energy[k] = 2 * energy / volumes;
  const std::size_t size = m.stretch.size();
  for (std::size_t c = 0; c < 6 && traits_.stress; ++c) m.stress[c * size + k] = weight > 0 ? stress[c] / weight : 0.0;
}

/// Copies of bonds that were found have the same value, and fail with them.
void BondCriterion::find_copies() {
  std::vector<Found> all;
  std::vector<BondCopies::Copy> copies;
  for (const Found& f : found_) {
    copies_->find(f.change.bond.point, f.change.bond.far, copies);
    for (const BondCopies::Copy& copy : copies)
      if (families_.integrity(copy.bond()) > f.change.integrity) all.push_back({{copy.bond(), f.change.integrity}, f.value});
  }
  keep_each_once(all, [](const Found& f) { return f.change.bond; });
  found_ = std::move(all);
}

}  // namespace perikit
