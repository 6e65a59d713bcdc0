#include "operators/bond_samples.hpp"

#include <algorithm>
#include <tuple>

namespace perikit {

void BondSamples::clear(std::span<const std::uint8_t> kept) {
  kept_ = kept;
  all_.clear();
  of_thread_.resize(static_cast<std::size_t>(thread_count()));
  for (auto& entries : of_thread_) entries.clear();
}

void BondSamples::add(const Entry& entry) {
  if (keeps(entry.owner, entry.far)) of_thread_[static_cast<std::size_t>(thread_index())].push_back(entry);
}

void BondSamples::add(int n, const BatchScratch& s) {
  std::vector<Entry>& entries = of_thread_[static_cast<std::size_t>(thread_index())];
  for (int l = 0; l < n; ++l) {
    const double w = s.weight[l];
    if (w == 0 || s.owner[l] == s.far[l] || !keeps(s.owner[l], s.far[l])) continue;
    Entry& entry = entries.emplace_back(Entry{s.owner[l], s.far[l], w, w * s.psi[l], {}});
    if (!stress_) continue;
    double sigma[3][3];
    cauchy_stress(space_, s, l, sigma);
    constexpr int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    for (int c = 0; c < 6; ++c) entry.stress[c] = 0.5 * w * (sigma[pair[c][0]][pair[c][1]] + sigma[pair[c][1]][pair[c][0]]);
  }
}

void BondSamples::merge() {
  for (const auto& entries : of_thread_) all_.insert(all_.end(), entries.begin(), entries.end());
  // Evaluation points of one bond or point come from one thread, in an order that is always the same.
  std::stable_sort(all_.begin(), all_.end(),
                   [](const Entry& a, const Entry& b) { return std::tie(a.owner, a.far) < std::tie(b.owner, b.far); });
  std::size_t kept = 0;
  for (std::size_t k = 0; k < all_.size(); ++k) {
    Entry& last = all_[kept > 0 ? kept - 1 : 0];
    if (kept == 0 || last.owner != all_[k].owner || last.far != all_[k].far) {
      all_[kept++] = all_[k];
      continue;
    }
    last.weight += all_[k].weight;
    last.energy += all_[k].energy;
    for (int c = 0; c < 6; ++c) last.stress[c] += all_[k].stress[c];
  }
  all_.resize(kept);
}

const BondSamples::Entry* BondSamples::find(std::int32_t owner, std::int32_t far) const noexcept {
  const auto at = std::lower_bound(
      all_.begin(), all_.end(), std::pair(owner, far),
      [](const Entry& e, const std::pair<std::int32_t, std::int32_t>& key) { return std::pair(e.owner, e.far) < key; });
  return at != all_.end() && at->owner == owner && at->far == far ? &*at : nullptr;
}

}  // namespace perikit
