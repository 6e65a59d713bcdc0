#include "families/cloud_families.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "families/cloud_rows.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

namespace {

constexpr double cut_bond = -1;  ///< in place of the influence, until the lists are compacted

/// K += w xi (x) xi. One piece of machine code for all who sum: mended families are bitwise what they were.
template <int D>
[[gnu::noinline]] void add_shape(double w, const Row& xi, double* K) noexcept {
  for (int a = 0; a < D; ++a)
    for (int e = a; e < D; ++e) K[symmetric_index(D, a, e)] += w * xi[a] * xi[e];
}

}  // namespace

CloudFamilies::CloudFamilies(const Body& b, const InfluenceFunction& influence, BondWeight kind)
    : body(b),
      lists(find_families(b.rows(), b.points(), b.dimension(), b.horizon())),
      condition(b.make_field(1)),
      damage(b.make_field(1)) {
  const std::size_t n = body.points();
  omega.resize(bonds());
  inverse.assign(6 * n, 0.0);
  weight.assign(n, 0.0);
  normaliser.assign(n, 0.0);
  switch (body.dimension()) {
    case 1:
      measure<1>(influence, kind);
      break;
    case 2:
      measure<2>(influence, kind);
      break;
    default:
      measure<3>(influence, kind);
  }
  if (broken > 0) compact();
}

template <int D>
void CloudFamilies::measure(const InfluenceFunction& influence, BondWeight kind) {
  const Row* position = reinterpret_cast<const Row*>(body.rows().data());
  std::atomic<std::size_t> cut{0}, irregular{0};
  std::mutex guard;
  parallel_for(cloud_blocks(body.points()), [&](std::size_t b) {
    std::vector<double> r;
    for (std::size_t p = b * cloud_block_points; p < std::min(body.points(), (b + 1) * cloud_block_points); ++p) {
      const std::span<const std::int32_t> family = neighbours(p);
      double* value = omega.data() + lists.first[p];
      const Point x = body.position(p);
      r.clear();
      for (const std::int32_t j : family) {
        const Row xi = position[j] - position[p];
        r.push_back(std::min(1.0, std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]) / body.horizon()));
      }
      influence.evaluate(r, {value, family.size()});
      const bool near_crack =
          std::any_of(body.cracks().begin(), body.cracks().end(), [&](const Crack& c) { return c.near(x, body.horizon()); });
      double K[6] = {}, whole = 0, intact = 0;
      std::array<double, 6> whole_shape{};
      bool any_cut = false;
      for (std::size_t k = 0; k < family.size(); ++k) {
        const std::int32_t j = family[k];
        const double w = value[k] * position[j][3];
        whole += w;
        normaliser[p] += kind == BondWeight::kernel ? w : position[j][3];
        if (near_crack) add_shape<D>(w, position[j] - position[p], whole_shape.data());
        if (near_crack && body.cut(x, body.position(static_cast<std::size_t>(j)))) {
          value[k] = cut_bond;
          any_cut = true;
          ++cut;
          continue;
        }
        intact += w;
        add_shape<D>(w, position[j] - position[p], K);
      }
      if (any_cut) {
        const std::lock_guard lock(guard);
        cracked_shape_.emplace_back(static_cast<std::int32_t>(p), whole_shape);
      }
      if (!invert_shape(D, K, &inverse[6 * p], condition.data() + p)) ++irregular;
      const double share = whole > 0 ? intact / whole : 0.0;
      weight[p] = position[p][3] * share;
      damage.data()[p] = whole > 0 ? 1 - share : 0.0;
    }
  });
  broken = cut;
  singular = irregular;
}

void CloudFamilies::compact() {
  std::size_t kept = 0;
  std::int64_t begin = 0;
  for (std::size_t p = 0; p < body.points(); ++p) {
    const std::int64_t end = lists.first[p + 1];
    for (; begin < end; ++begin) {
      const auto k = static_cast<std::size_t>(begin);
      if (omega[k] == cut_bond) continue;
      lists.neighbour[kept] = lists.neighbour[k];
      omega[kept++] = omega[k];
    }
    lists.first[p + 1] = static_cast<std::int64_t>(kept);
  }
  lists.neighbour.resize(kept);
  omega.resize(kept);
}

BondState& CloudFamilies::bond_state() {
  if (bonds_) return *bonds_;
  bonds_.emplace(body, lists);
  whole_ = omega;
  switch (body.dimension()) {
    case 1: measure_whole<1>(); break;
    case 2: measure_whole<2>(); break;
    default: measure_whole<3>();
  }
  return *bonds_;
}

bool CloudFamilies::lost_bonds(std::size_t p) const noexcept {
  for (std::int64_t k = lists.first[p]; k < lists.first[p + 1]; ++k)
    if (integrity(static_cast<std::size_t>(k)) != 1) return true;
  return false;
}

template <int D>
void CloudFamilies::measure_whole() {
  const Row* position = reinterpret_cast<const Row*>(body.rows().data());
  total_.resize(body.points());
  intact_.resize(body.points());
  left_.assign(body.points(), 1.0);
  whole_shape_.assign(6 * body.points(), 0.0);
  for (std::size_t p = 0; p < body.points(); ++p) {
    double intact = 0;
    for (std::int64_t k = lists.first[p]; k < lists.first[p + 1]; ++k) {
      const std::int32_t j = lists.neighbour[static_cast<std::size_t>(k)];
      const double w = omega[static_cast<std::size_t>(k)] * position[j][3];
      intact += w;
      add_shape<D>(w, position[j] - position[p], &whole_shape_[6 * p]);
    }
    intact_[p] = intact;
    total_[p] = intact > 0 ? intact / (1 - damage.data()[p]) : 0.0;
  }
  for (const auto& [p, K] : cracked_shape_) std::copy(K.begin(), K.end(), &whole_shape_[6 * static_cast<std::size_t>(p)]);
}

template <int D>
double CloudFamilies::changed_point(std::size_t p) {
  const Row* position = reinterpret_cast<const Row*>(body.rows().data());
  double K[6] = {}, intact = 0;
  for (std::int64_t at = lists.first[p]; at < lists.first[p + 1]; ++at) {
    const auto k = static_cast<std::size_t>(at);
    const std::int32_t j = lists.neighbour[k];
    omega[k] = (*bonds_)[k] * whole_[k];
    const double w = omega[k] * position[j][3];
    intact += w;
    add_shape<D>(w, position[j] - position[p], K);
  }
  invert_shape(D, K, &inverse[6 * p], condition.data() + p);
  left_[p] = intact_[p] > 0 ? intact / intact_[p] : 1.0;
  const double share = total_[p] > 0 ? intact / total_[p] : 0.0;
  weight[p] = position[p][3] * share;
  damage.data()[p] = total_[p] > 0 ? 1 - share : 1.0;
  return shape_support(D, K, &whole_shape_[6 * p]);
}

std::vector<BondChange> CloudFamilies::changed(std::span<const std::int32_t> points) {
  std::vector<BondChange> left;
  for (const std::int32_t p : points) {
    const auto at = static_cast<std::size_t>(p);
    const double support = body.dimension() == 1 ? changed_point<1>(at) : body.dimension() == 2 ? changed_point<2>(at) : changed_point<3>(at);
    if (support >= least_support) continue;
    for (std::int64_t k = lists.first[at]; k < lists.first[at + 1]; ++k) {
      if ((*bonds_)[static_cast<std::size_t>(k)] == 0) continue;
      const std::int32_t far = lists.neighbour[static_cast<std::size_t>(k)];
      if (p < far) left.push_back({p, far, k, 0.0});
      else left.push_back({far, p, bonds_->index(far, p), 0.0});
    }
  }
  return left;
}

void CloudFamilies::load(std::size_t p, FamilyArrays& out) const {
  const std::span<const std::int32_t> family = neighbours(p);
  const Row* position = reinterpret_cast<const Row*>(body.rows().data());
  const Row own = position[p];
  out.resize(body.dimension(), static_cast<int>(family.size()));
  for (std::size_t k = 0; k < family.size(); ++k) {
    const Row far = position[family[k]], xi = far - own;
    for (int c = 0; c < out.dimension; ++c) out.xi[c][k] = xi[c];
    out.volume[k] = far[3];
  }
  std::copy_n(omega.data() + lists.first[p], family.size(), out.omega.data());
  for (std::size_t k = 0; k < out.size; k += pack_width) {
    Pack square(0.0);
    for (int c = 0; c < out.dimension; ++c) square += Pack::load(out.xi[c].data() + k) * Pack::load(out.xi[c].data() + k);
    sqrt(square).store(out.length.data() + k);
  }
  std::copy_n(&inverse[6 * p], 6, out.inverse_shape);
}

std::size_t CloudFamilies::bytes() const noexcept {
  return lists.neighbour.size() * sizeof(std::int32_t) + lists.first.size() * sizeof(std::int64_t) +
         (omega.size() + inverse.size() + weight.size() + normaliser.size()) * sizeof(double) + condition.bytes() + damage.bytes() +
         (whole_.size() + intact_.size() + left_.size() + total_.size() + whole_shape_.size()) * sizeof(double) + cracked_shape_.size() * sizeof(cracked_shape_[0]) + (bonds_ ? bonds_->bytes() : 0);
}

}  // namespace perikit
