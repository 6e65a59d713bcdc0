#include "assembly/point_families.hpp"

#include <algorithm>

#include "families/reproducing_kernel.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

PointFamilies::PointFamilies(const Body& body, const InfluenceFunction& influence, BondWeight weight)
    : body_(body), weight_(weight) {
  for (std::size_t p = 0; p < body.stride(); ++p)
    if (body.alive(p)) point_.push_back(static_cast<std::int32_t>(p));
  if (body.lattice()) {
    lattice_.emplace(body, influence, weight);
    read_lattice();
    return;
  }
  const CloudFamilies& f = cloud_.emplace(body, influence, weight);  // clouds have no padding in between: rows are field indices
  normaliser_ = f.normaliser;
  damage_.assign(f.damage.data(), f.damage.data() + rows());
}

void PointFamilies::read_lattice() {
  const LatticeFamilies& f = *lattice_;
  std::vector<std::int32_t> row_of(body_.stride(), -1), pattern_of(body_.stride() / chunk_points, -1);
  for (std::size_t r = 0; r < rows(); ++r) row_of[point(r)] = static_cast<std::int32_t>(r);
  for (const LatticeChunk& chunk : f.chunks) pattern_of[static_cast<std::size_t>(chunk.first / chunk_points)] = chunk.pattern;
  normaliser_.assign(rows(), 0.0);
  damage_.assign(rows(), 0.0);
  whole_.assign(rows(), 0);
  inverse_.assign(6 * rows(), 0.0);
  lattice_lists_.first.push_back(0);
  for (std::size_t r = 0; r < rows(); ++r) {
    const std::size_t p = point(r);
    const int lane = static_cast<int>(p % chunk_points);
    const std::int32_t index = pattern_of[p / chunk_points];
    const LatticePattern& pattern = index < 0 ? f.whole : f.patterns[static_cast<std::size_t>(index)];
    std::vector<std::uint16_t> slots = f.intact_slots(pattern, lane);
    std::sort(slots.begin(), slots.end(), [&](std::uint16_t a, std::uint16_t b) { return f.shifts[a] < f.shifts[b]; });
    for (const std::uint16_t s : slots)
      lattice_lists_.neighbour.push_back(row_of[static_cast<std::size_t>(static_cast<std::int64_t>(p) + f.shifts[s])]);
    slot_.insert(slot_.end(), slots.begin(), slots.end());
    lattice_lists_.first.push_back(static_cast<std::int64_t>(slot_.size()));
    f.inverse_shape(pattern, lane, &inverse_[6 * r]);
    normaliser_[r] = pattern.scale[lane] > 0 ? f.volume / pattern.scale[lane] : 0.0;
    damage_[r] = pattern.damage[lane];
    whole_[r] = slots.size() == f.offsets.size();
  }
}

void PointFamilies::set_bonds(std::span<const BondChange> changes) {
  if (integrity_.empty()) {
    if (changes.empty()) return;
    if (cloud_) inverse_ = cloud_->inverse;
    first_ = {damage_, inverse_, whole_};
  }
  // From the set-up on: what follows from the bonds must not depend on the order in which they failed.
  integrity_.assign(bonds(), 1.0);
  damage_ = first_.damage;
  inverse_ = first_.inverse;
  whole_ = first_.whole;
  weakened_ = false;
  std::vector<std::size_t> ends;
  const auto row_of = [&](std::int32_t p) {
    return static_cast<std::size_t>(std::lower_bound(point_.begin(), point_.end(), p) - point_.begin());
  };
  const auto lower = [&](std::size_t row, std::size_t far, double b) {
    const auto family = neighbours(row);
    integrity_[first(row) +
               static_cast<std::size_t>(std::lower_bound(family.begin(), family.end(), static_cast<std::int32_t>(far)) -
                                        family.begin())] = b;
    ends.push_back(row);
  };
  for (const BondChange& c : changes) {
    const std::size_t row = row_of(c.point), far = row_of(c.far);
    lower(row, far, c.integrity);
    lower(far, row, c.integrity);
    weakened_ = weakened_ || (c.integrity > 0 && c.integrity < 1);
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (const std::size_t row : ends) changed(row);
}

void PointFamilies::changed(std::size_t row) {
  FamilyArrays family;
  load_first(row, family);
  double K[6] = {}, whole = 0, left = 0;
  const int d = family.dimension;
  for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k) {
    const double w = family.omega[k] * family.volume[k], b = integrity_[first(row) + k];
    whole += w;
    left += b * w;
    for (int a = 0; a < d; ++a)
      for (int e = a; e < d; ++e) K[symmetric_index(d, a, e)] += b * w * family.xi[a][k] * family.xi[e][k];
  }
  double* inverse = &inverse_[6 * row];
  invert_shape(d, K, inverse);
  damage_[row] = whole > 0 ? 1 - (1 - first_.damage[row]) * left / whole : 1.0;
  if (!whole_.empty()) whole_[row] = 0;
}

void PointFamilies::load(std::size_t row, FamilyArrays& out) const {
  load_first(row, out);
  if (integrity_.empty()) return;
  for (std::size_t k = 0; k < static_cast<std::size_t>(out.bonds); ++k) out.omega[k] *= integrity_[first(row) + k];
  std::copy_n(&inverse_[6 * row], 6, out.inverse_shape);
  out.integrity.clear();
  if (!weakened_) return;
  out.integrity.assign(out.size, 1.0);
  std::copy_n(integrity_.data() + first(row), out.bonds, out.integrity.begin());
}

void PointFamilies::load_first(std::size_t row, FamilyArrays& out) const {
  if (cloud_) return cloud_->load(row, out);
  lattice_->load({slot_.data() + first(row), first(row + 1) - first(row)}, out);
  std::copy_n(&inverse_[6 * row], 6, out.inverse_shape);
}

void PointFamilies::bond_shares(std::size_t row, const FamilyArrays& family, AlignedVector<double>& share) const {
  share.assign(family.size, 0.0);
  for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k)
    share[k] =
        family.volume[k] * (weight_ == BondWeight::kernel ? family.omega[k] : integrity(first(row) + k)) / normaliser_[row];
}

std::size_t PointFamilies::bytes() const noexcept {
  return (lattice_ ? lattice_->bytes() : cloud_->bytes()) + rows() * 4 + lattice_lists_.neighbour.size() * 6 +
         lattice_lists_.first.size() * 8 + (normaliser_.size() + damage_.size() + inverse_.size()) * 8 + whole_.size() +
         (integrity_.size() + first_.damage.size() + first_.inverse.size()) * 8 + first_.whole.size();
}

bool point_gradient(const FamilyArrays& family, double horizon, int order, std::vector<double>& g) {
  if (order > 1) return reproducing_kernel(family, horizon, order, g) > 0;
  const int d = family.dimension;
  g.assign(static_cast<std::size_t>(family.bonds * d), 0.0);
  for (int k = 0; k < family.bonds; ++k)
    for (int e = 0; e < d; ++e)
      for (int a = 0; a < d; ++a) {
        const auto bond = static_cast<std::size_t>(k);
        g[static_cast<std::size_t>(k * d + e)] +=
            family.omega[bond] * family.volume[bond] * family.inverse_shape[symmetric_index(d, a, e)] * family.xi[a][bond];
      }
  return family.inverse_shape[0] != 0;
}

}  // namespace perikit
