#include "families/cloud/cloud_families.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "body/family_limit.hpp"
#include "core/each_once.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "families/stencils.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

// One piece of machine code for all who sum: mended families are bitwise what they were. A product that is added where it was
// made may be rounded once or twice.

[[gnu::noinline]] void add_weight(double w, double& sum) noexcept { sum += w; }

/// K += w xi (x) xi
template <int D>
[[gnu::noinline]] void add_shape(double w, const Row& xi, double* K) noexcept {
  add_to_shape_tensor<D>(w, xi, K);
}

double squared(const Row& x) noexcept { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; }

const Row* positions(const Body& body) noexcept { return reinterpret_cast<const Row*>(body.rows().data()); }

}  // namespace

CloudFamilies::CloudFamilies(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs)
    : Families(body, std::move(influence), needs),
      lists_(find_families(body.rows(), body.points(), body.dimension(), body.horizon(),
                           [&](std::size_t p) { return body.image(p) ? -1 : body.number(p); })) {
  const std::size_t n = body.points();
  for (AlignedVector<double>* values : {&volumes_, &influences_, &damage_}) values->assign(n, 0.0);
  if (needs.influence) omega_.resize(lists_.neighbour.size());
  if (needs.shapes) {
    inverse_.assign(6 * n, 0.0);
    condition_.assign(n, 0.0);
  }
  switch (body.dimension()) {
    case 1: measure<1>(); break;
    case 2: measure<2>(); break;
    default: measure<3>();
  }
  if (cut_ > 0) compact();
  bonds_ = lists_.neighbour.size();
  if (needs.shapes) return;
  volumes_ = {};
  influences_ = {};
}

template <int D>
void CloudFamilies::measure() {
  const Row* position = positions(body_);
  std::atomic<std::size_t> cut{0}, irregular{0};
  const CloudBlocks pieces = pieces_of(body_.points());
  parallel_for(pieces.count(), [&](std::size_t block) {
    std::vector<double> r, omega;
    for (std::size_t p = pieces.begin(block); p < pieces.end(block); ++p) {
      const std::span<std::int32_t> family(lists_.neighbour.data() + lists_.first[p], neighbours(p).size());
      const Point x = body_.position(p);
      r.clear();
      for (const std::int32_t j : family) r.push_back(relative_length(std::sqrt(squared(position[j] - position[p])), body_.horizon()));
      omega.assign(r.size(), 1.0);
      if (needs_.influence) {
        influence_->evaluate(r, omega);
        std::copy(omega.begin(), omega.end(), omega_.begin() + lists_.first[p]);
      }
      const bool near_crack = std::any_of(body_.cracks().begin(), body_.cracks().end(), [&](const Crack& c) { return c.near(x, body_.horizon()); });
      double K[6] = {}, intact = 0;
      for (std::size_t k = 0; k < family.size(); ++k) {
        const std::int32_t j = family[k];
        const double w = omega[k] * position[j][3];
        add_weight(w, influences_[p]);
        volumes_[p] += position[j][3];
        if (near_crack && body_.cut(x, body_.position(static_cast<std::size_t>(j)))) {
          family[k] = ~j;   // marked, until the lists are compacted
          ++cut;
          continue;
        }
        add_weight(w, intact);
        if (needs_.shapes) add_shape<D>(w, position[j] - position[p], K);
      }
      const double share = influences_[p] > 0 ? intact / influences_[p] : 0.0;
      damage_[p] = influences_[p] > 0 ? 1 - share : 0.0;
      if (needs_.shapes ? !invert_shape(D, K, &inverse_[6 * p], &condition_[p]) : !(intact > 0)) ++irregular;
    }
  });
  cut_ = cut;
  singular_ = irregular;
}

void CloudFamilies::compact() {
  std::size_t kept = 0;
  std::int64_t begin = 0;
  for (std::size_t p = 0; p < body_.points(); ++p) {
    const std::int64_t end = lists_.first[p + 1];
    for (; begin < end; ++begin) {
      const auto k = static_cast<std::size_t>(begin);
      const std::int32_t j = lists_.neighbour[k];
      if (j < 0) {
        cuts_.push_back({static_cast<std::int32_t>(p), ~j, omega(k)});
        continue;
      }
      if (!omega_.empty()) omega_[kept] = omega_[k];
      lists_.neighbour[kept++] = j;
    }
    lists_.first[p + 1] = static_cast<std::int64_t>(kept);
  }
  lists_.neighbour.resize(kept);
  if (!omega_.empty()) omega_.resize(kept);
}

void CloudFamilies::make_room() {
  const std::size_t n = body_.points();
  integrity_.assign(lists_.neighbour.size(), 1.0);
  whole_ = omega_;
  left_.assign(n, 1.0);
  fragment_.assign(n, 0);
  intact_.assign(n, 0.0);
  const Row* position = positions(body_);
  for (std::size_t p = 0; p < n; ++p)
    for (std::int64_t k = lists_.first[p]; k < lists_.first[p + 1]; ++k)
      add_weight(omega(static_cast<std::size_t>(k)) * position[lists_.neighbour[static_cast<std::size_t>(k)]][3], intact_[p]);
  if (needs_.shapes) return;
  influences_ = intact_;
  for (const CutBond& cut : cuts_) influences_[static_cast<std::size_t>(cut.point)] += cut.omega * position[cut.far][3];
}

template <int D>
void CloudFamilies::renew(std::size_t p) {
  const Row* position = positions(body_);
  double K[6] = {}, uncut[6] = {}, intact = 0;
  for (std::int64_t at = lists_.first[p]; at < lists_.first[p + 1]; ++at) {
    const auto k = static_cast<std::size_t>(at);
    const Row far = position[lists_.neighbour[k]], xi = far - position[p];
    const double w = integrity_[k] * whole_omega(k) * far[3];
    if (!omega_.empty()) omega_[k] = integrity_[k] * whole_[k];
    add_weight(w, intact);
    if (!needs_.shapes) continue;
    add_shape<D>(w, xi, K);
    add_shape<D>(whole_omega(k) * far[3], xi, uncut);
  }
  left_[p] = intact_[p] > 0 ? intact / intact_[p] : 1.0;
  damage_[p] = influences_[p] > 0 ? 1 - intact / influences_[p] : 1.0;
  if (!needs_.shapes) return;
  for (const CutBond& bond : cut_bonds(p)) add_shape<D>(bond.omega * position[bond.far][3], position[bond.far] - position[p], uncut);
  invert_shape(D, K, &inverse_[6 * p], &condition_[p]);
  const double support = left_[p] < 1 ? shape_support(D, K, uncut) : 1.0;
  fragment_[p] = support < least_support;
  if (support >= needle_support) return;
  std::fill_n(&inverse_[6 * p], 6, 0.0);
  condition_[p] = std::numeric_limits<double>::infinity();
}

std::vector<std::int32_t> CloudFamilies::set_bonds(std::span<const BondChange> changes) {
  std::vector<std::int32_t> ends;
  for (const auto& [bond, integrity] : changes) {
    for (const auto& [from, to] : {std::pair(bond.point, bond.far), std::pair(bond.far, bond.point)}) {
      integrity_[static_cast<std::size_t>(index(from, to))] = integrity;
      ends.push_back(from);
    }
  }
  keep_each_once(ends);
  for (const std::int32_t p : ends) {
    const auto at = static_cast<std::size_t>(p);
    body_.dimension() == 1 ? renew<1>(at) : body_.dimension() == 2 ? renew<2>(at) : renew<3>(at);
  }
  return ends;
}

std::vector<std::int32_t> CloudFamilies::mend_bonds() {
  std::vector<BondChange> whole = changed();
  for (BondChange& change : whole) change.integrity = 1;
  return set_bonds(whole);
}

std::vector<BondChange> CloudFamilies::changed() const {
  std::vector<BondChange> changes;
  for (std::size_t p = 0; p < (integrity_.empty() ? 0 : body_.points()); ++p)
    for (auto k = static_cast<std::size_t>(index(static_cast<std::int32_t>(p), static_cast<std::int32_t>(p))); k < static_cast<std::size_t>(lists_.first[p + 1]); ++k)
      if (integrity_[k] != 1) changes.push_back({{static_cast<std::int32_t>(p), lists_.neighbour[k]}, integrity_[k]});
  return changes;
}

bool CloudFamilies::lost_bonds(std::size_t p) const noexcept {
  for (std::int64_t k = lists_.first[p]; k < lists_.first[p + 1]; ++k)
    if (b(static_cast<std::size_t>(k)) != 1) return true;
  return false;
}

double CloudFamilies::integrity(BondId bond) const noexcept { return b(static_cast<std::size_t>(index(bond.point, bond.far))); }

std::int64_t CloudFamilies::index(std::int32_t point, std::int32_t far) const noexcept {
  const auto family = neighbours(static_cast<std::size_t>(point));
  return lists_.first[static_cast<std::size_t>(point)] + (std::lower_bound(family.begin(), family.end(), far) - family.begin());
}

std::span<const CloudFamilies::CutBond> CloudFamilies::cut_bonds(std::size_t p) const noexcept {
  const auto before = [](const CutBond& bond, std::size_t q) { return static_cast<std::size_t>(bond.point) < q; };
  const auto begin = std::lower_bound(cuts_.begin(), cuts_.end(), p, before), end = std::lower_bound(begin, cuts_.end(), p + 1, before);
  return {begin, end};
}

void CloudFamilies::load(std::size_t p, BondsOf which, FamilyArrays& out) const {
  const std::span<const std::int32_t> family = neighbours(p);
  out.owner = static_cast<std::int32_t>(p);
  out.resize(body_.dimension(), static_cast<int>(family.size()));
  std::copy(family.begin(), family.end(), out.far.begin());
  if (omega_.empty()) std::fill_n(out.omega.begin(), family.size(), 1.0);
  else std::copy_n(omega_.data() + lists_.first[p], family.size(), out.omega.data());
  out.integrity.clear();
  out.whole.clear();
  const bool cuts = which == BondsOf::uncut && !cuts_.empty() && !cut_bonds(p).empty();
  if (cuts || (!integrity_.empty() && lost_bonds(p))) load_broken(p, which, out);
  const Row* position = positions(body_);
  const Row own = position[p];
  for (std::size_t k = 0; k < out.far.size(); ++k) {
    const Row far = position[out.far[k]], xi = far - own;
    for (int c = 0; c < out.dimension; ++c) out.xi[c][k] = xi[c];
    out.volume[k] = far[3];
  }
  for (std::size_t k = 0; k < out.size; k += pack_width) {
    Pack square(0.0);
    for (int c = 0; c < out.dimension; ++c) square += Pack::load(out.xi[c].data() + k) * Pack::load(out.xi[c].data() + k);
    sqrt(square).store(out.length.data() + k);
  }
  if (needs_.shapes) std::copy_n(&inverse_[6 * p], 6, out.inverse_shape);
  out.fragment = is_fragment(p) && !std::isfinite(condition_[p]);
}

void CloudFamilies::load_broken(std::size_t p, BondsOf which, FamilyArrays& out) const {
  struct Bond {
    std::int32_t far;
    double omega, b;
  };
  std::vector<Bond> bonds;
  for (auto k = static_cast<std::size_t>(lists_.first[p]); k < static_cast<std::size_t>(lists_.first[p + 1]); ++k)
    if (which != BondsOf::intact || b(k) > 0) bonds.push_back({lists_.neighbour[k], whole_omega(k), b(k)});
  if (which == BondsOf::uncut) {
    for (const CutBond& cut : cut_bonds(p)) bonds.push_back({cut.far, cut.omega, 0.0});
    std::sort(bonds.begin(), bonds.end(), [](const Bond& a, const Bond& b) { return a.far < b.far; });
  }
  out.resize(body_.dimension(), static_cast<int>(bonds.size()));
  out.integrity.assign(out.size, 1.0);
  out.whole.assign(out.size, 0.0);
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    out.far[k] = bonds[k].far;
    out.whole[k] = bonds[k].omega;
    out.integrity[k] = bonds[k].b;
    out.omega[k] = bonds[k].b * bonds[k].omega;
  }
  if (std::any_of(bonds.begin(), bonds.end(), [](const Bond& bond) { return bond.b != 1; })) return;
  out.integrity.clear();
  out.whole.clear();
}

void CloudFamilies::each_class(const std::function<void(std::span<const std::int32_t>)>& visit) const {
  for (std::size_t p = 0; p < body_.points(); ++p) {
    const auto point = static_cast<std::int32_t>(p);
    visit({&point, 1});
  }
}

void CloudFamilies::mark(std::span<const std::int32_t> points, GroupMarks& marks) const {
  for (const std::int32_t point : points) {
    perikit::mark(marks, static_cast<std::size_t>(point));
    for (const std::int32_t j : neighbours(static_cast<std::size_t>(point))) perikit::mark(marks, static_cast<std::size_t>(j));
  }
}

std::size_t CloudFamilies::bytes() const noexcept {
  std::size_t doubles = 0;
  for (const auto* values : {&omega_, &inverse_, &condition_, &volumes_, &influences_, &damage_, &integrity_, &whole_, &intact_, &left_})
    doubles += values->size();
  return lists_.neighbour.size() * sizeof(std::int32_t) + lists_.first.size() * sizeof(std::int64_t) + doubles * sizeof(double) +
         cuts_.size() * sizeof(CutBond) + fragment_.size();
}

}  // namespace perikit
