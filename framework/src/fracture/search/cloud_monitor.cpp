#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/each_once.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "families/cloud/nearest_failure.hpp"
#include "fracture/body_damage.hpp"
#include "fracture/search/bond_monitor.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

/// One point at a time; each bond at the end with the smaller index. Margins are lengths: the ends of a bond move apart by no more than
/// the diagonal of a box around the motion of its cell and the cells of the partners. Rigid translations count for nothing.
class CloudMonitor final : public BondMonitor {
 public:
  CloudMonitor(const CloudFamilies& families, const BodyDamage& damage, bool skip, const NearestFailure* known)
      : BondMonitor(families.body(), skip), families_(families), lists_(families.lists()), damage_(damage), known_(known),
        position_(reinterpret_cast<const Row*>(families.body().rows().data())) {
    make_cells();
  }

 private:
  void make_cells();
  bool begin(ConstFieldView u) override;
  bool near_failure(const Group& group) const noexcept override;
  void bound_motion(ConstFieldView u, std::span<double> moved) override;
  double check(const Group& group, ConstFieldView u, std::vector<BondChange>& changes) override;
  bool between(std::int64_t bond, std::int32_t p, double stretch, double onset, std::vector<BondChange>& changes) const;
  std::size_t bytes() const noexcept override { return BondMonitor::bytes() + u_.size() * sizeof(Row); }

  const CloudFamilies& families_;
  const FamilyLists& lists_;
  const BodyDamage& damage_;
  const NearestFailure* known_;
  const Row* position_;
  std::vector<std::vector<std::int32_t>> near_;   ///< by cell: those with partners of its points, itself too
  std::vector<Row> low_, high_;                   ///< motion by cell
  AlignedVector<Row> u_;                          ///< mirror, where the loop over forces has none of this displacement
  const Row* rows_ = nullptr;                     ///< the one that is looked at
};

void CloudMonitor::make_cells() {
  constexpr std::size_t cell_points = 64;   // consecutive points lie near each other
  const std::size_t n = body_.points(), cells = (n + cell_points - 1) / cell_points;
  std::vector<Group> groups;
  std::vector<std::size_t> first;
  near_.resize(cells);
  low_.resize(cells);
  high_.resize(cells);
  for (std::size_t c = 0; c < cells; ++c) {
    first.push_back(groups.size());
    const std::size_t end = std::min(n, (c + 1) * cell_points);
    for (std::size_t p = c * cell_points; p < end; p += padding) {
      const std::size_t live = std::min(padding, end - p);
      groups.push_back({static_cast<std::int32_t>(p), static_cast<std::uint8_t>((1u << live) - 1), 0});
    }
    std::vector<std::int32_t>& near = near_[c];
    near.push_back(static_cast<std::int32_t>(c));
    for (std::int64_t k = lists_.first[c * cell_points]; k < lists_.first[end]; ++k) {
      const auto cell = static_cast<std::int32_t>(static_cast<std::size_t>(lists_.neighbour[static_cast<std::size_t>(k)]) / cell_points);
      if (cell != near.back()) near.push_back(cell);
    }
    keep_each_once(near);
  }
  first.push_back(groups.size());
  set_cells(std::move(groups), std::move(first));
}

void CloudMonitor::bound_motion(ConstFieldView u, std::span<double> moved) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  over_cells([&](std::size_t cell) {
    Row low{infinite, infinite, infinite}, high{-infinite, -infinite, -infinite};
    for (const Group& group : groups_of(cell))
      for (int l = 0; l < static_cast<int>(padding); ++l) {
        if (!(group.live >> l & 1)) continue;
        for (int c = 0; c < u.components; ++c) {
          const double step = u.component(c)[group.first + l] - reference_.component(c)[group.first + l];
          low[c] = std::min(low[c], step);
          high[c] = std::max(high[c], step);
        }
      }
    low_[cell] = low;
    high_[cell] = high;
  });
  over_cells([&](std::size_t cell) {
    Row low = low_[cell], high = high_[cell];
    for (const std::int32_t k : near_[cell]) {
      const Row below = low_[static_cast<std::size_t>(k)], above = high_[static_cast<std::size_t>(k)];
      for (int c = 0; c < u.components; ++c) {
        low[c] = std::min(low[c], below[c]);
        high[c] = std::max(high[c], above[c]);
      }
    }
    double square = 0;
    for (int c = 0; c < u.components; ++c) square += (high[c] - low[c]) * (high[c] - low[c]);
    moved[cell] = std::sqrt(square);
  });
}

bool CloudMonitor::begin(ConstFieldView u) {
  const AlignedVector<Row>* known = known_ ? known_->u : nullptr;
  std::atomic<bool> same{known != nullptr};
  const CloudBlocks pieces = pieces_of(body_.points());
  if (known)
    parallel_for(pieces.count(), [&](std::size_t b) {
      bool here = true;
      for (std::size_t p = pieces.begin(b); p < pieces.end(b); ++p)
        for (int c = 0; c < u.components; ++c) here &= u.component(c)[p] == (*known)[p][c];
      if (!here) same = false;
    });
  if (!same) mirror_rows(u, body_.points(), u_);
  rows_ = same ? known->data() : u_.data();
  return same;
}

bool CloudMonitor::near_failure(const Group& group) const noexcept {
  const double* excess = known_->excess.data() + group.first;
  bool near = false;
  for (int l = 0; l < static_cast<int>(padding); ++l)
    if (group.live >> l & 1) near |= !(excess[l] < -1e-12 * body_.horizon());
  return near;
}

double CloudMonitor::check(const Group& group, ConstFieldView, std::vector<BondChange>& changes) {
  constexpr std::int64_t at_once = 64;
  alignas(64) double square[at_once], difference[at_once], limit[at_once];
  const Pack none(std::numeric_limits<double>::infinity());
  Pack margin = none;
  for (int l = 0; l < static_cast<int>(padding); ++l) {
    if (!(group.live >> l & 1)) continue;
    const std::int32_t p = group.first + l;
    const Row own_position = position_[p], own_u = rows_[p];
    const std::int64_t end = lists_.first[static_cast<std::size_t>(p) + 1];
    for (std::int64_t k = families_.index(p, p); k < end; k += at_once) {
      const auto n = static_cast<int>(std::min(at_once, end - k)), lanes = (n + pack_width - 1) / pack_width * pack_width;
      for (int b = 0; b < n; ++b) {
        const std::int32_t j = lists_.neighbour[static_cast<std::size_t>(k + b)];
        const Row xi = position_[j] - own_position, du = rows_[j] - own_u, squares = xi * xi, changes = du * (xi + xi + du);
        square[b] = squares[0] + squares[1] + squares[2];
        difference[b] = changes[0] + changes[1] + changes[2];
        limit[b] = damage_.limits(static_cast<std::size_t>(p), static_cast<std::size_t>(j)).onset;
      }
      for (int b = 0; b < n; ++b)
        if (families_.b(static_cast<std::size_t>(k + b)) == 0) square[b] = 1, difference[b] = 0, limit[b] = std::numeric_limits<double>::infinity();
      for (int b = n; b < lanes; ++b) square[b] = 1, difference[b] = 0, limit[b] = std::numeric_limits<double>::infinity();
      for (int b = 0; b < lanes; b += pack_width) {
        // e = (|y|^2 - |xi|^2)/(|y| + |xi|)
        const Pack squared = Pack::load(square + b), change = Pack::load(difference + b), length = sqrt(squared), e = change / (sqrt(squared + change) + length),
                   left = Pack::load(limit + b) * length - e;
        const PackMask far = left > Pack(1e-13) * length;
        margin = min(margin, select(far, left, none));
        if (all(far)) continue;
        alignas(64) double lengths[pack_width], extensions[pack_width], rest[pack_width];
        length.store(lengths);
        e.store(extensions);
        left.store(rest);
        for (int lane = 0; lane < std::min(pack_width, n - b); ++lane) {
          if (rest[lane] > 1e-13 * lengths[lane]) continue;
          if (between(k + b + lane, p, extensions[lane] / lengths[lane], limit[b + lane], changes)) margin = Pack(0.0);
        }
      }
    }
  }
  alignas(64) double least[pack_width];
  margin.store(least);
  return *std::min_element(least, least + pack_width);
}

/// A bond beyond its onset: appended where its integrity falls. Whether it stays between whole and broken, to be looked at every time.
bool CloudMonitor::between(std::int64_t bond, std::int32_t p, double stretch, double onset, std::vector<BondChange>& changes) const {
  const auto k = static_cast<std::size_t>(bond);
  const std::int32_t j = lists_.neighbour[k];
  alignas(64) double s[padding] = {stretch}, start[padding] = {onset}, now[padding] = {},
                     failure[padding] = {damage_.limits(static_cast<std::size_t>(p), static_cast<std::size_t>(j)).failure};
  damage_.law->integrity({1, s, start, failure, now});
  if (now[0] < families_.b(k)) changes.push_back({{p, j}, now[0]});
  return std::min(now[0], families_.b(k)) > 0;
}

}  // namespace

std::unique_ptr<BondFinder> make_cloud_monitor(const CloudFamilies& families, const BodyDamage& damage, bool skip, const NearestFailure* known) {
  return std::make_unique<CloudMonitor>(families, damage, skip, known);
}

}  // namespace perikit
