#include "operators/bond_samples.hpp"

#include <algorithm>
#include <limits>

#include "operators/lane_stresses.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

void BondSamples::clear(std::span<const std::uint8_t> kept) {
  kept_ = kept;
  wanted_ = {};
  both_ways_ = false;
  all_.clear();
  of_thread_.resize(static_cast<std::size_t>(thread_count()));
  for (auto& entries : of_thread_) entries.clear();
}

void BondSamples::add(const Entry& entry) {
  if (keeps(entry.owner, entry.far)) of_thread_[static_cast<std::size_t>(thread_index())].push_back(entry);
}

void BondSamples::add(int n, const BatchScratch& s, bool selective) {
  std::vector<Entry>& entries = of_thread_[static_cast<std::size_t>(thread_index())];
  LaneStresses stresses;
  const int components = dimension(space_) * dimension(space_);
  if (what_ == BondSampling::stress) stresses.find(n, space_, s);
  for (int l = 0; l < n; ++l) {
    const double w = s.weight[l];
    if (w == 0 || s.owner[l] == s.far[l] || !keeps(s.owner[l], s.far[l])) continue;
    Entry& entry = entries.emplace_back(Entry{s.owner[l], s.far[l], w, w * s.psi[l]});
    if (what_ == BondSampling::derivative) {
      for (int k = 0; k < components; ++k) entry.tensor[k] = (selective ? 1.0 : w) * s.P[k * batch_points + l];
      if (selective) {
        entry.pressure = s.pressure[l];
        entry.growth = s.growth[l];
      }
    }
    if (what_ != BondSampling::stress) continue;
    constexpr int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const auto sigma = [&](int a, int b) { return stresses.sigma[3 * a + b][l]; };
    for (int c = 0; c < 6; ++c) entry.tensor[c] = 0.5 * w * (sigma(pair[c][0], pair[c][1]) + sigma(pair[c][1], pair[c][0]));
  }
}

void BondSamples::merge() {
  // Sorted by owner in one sweep, and then the few entries of each by their far ends.
  std::int32_t highest = -1;
  any_whole_ = false;
  // Where one thread has all of them in order, as one thread does on clouds, they stay where they are.
  const auto full = [](const std::vector<Entry>& entries) { return !entries.empty(); };
  if (const auto one = std::ranges::find_if(of_thread_, full); one != of_thread_.end() && std::ranges::count_if(of_thread_, full) == 1) {
    lowest_ = one->front().owner;
    first_.assign(1, 0);
    std::size_t k = 0;
    for (const Entry* last = nullptr; k < one->size(); last = &(*one)[k++]) {
      const Entry& entry = (*one)[k];
      if (last && (last->owner > entry.owner || (last->owner == entry.owner && last->far >= entry.far))) break;
      any_whole_ |= entry.far < 0;
      if (const auto o = static_cast<std::size_t>(entry.owner - lowest_); first_.size() <= o) first_.resize(o + 1, k);
    }
    if (k == one->size()) {
      all_.swap(*one);
      return first_.push_back(k);
    }
    any_whole_ = false;
  }
  lowest_ = std::numeric_limits<std::int32_t>::max();
  for (const auto& entries : of_thread_)
    for (const Entry& entry : entries) {
      lowest_ = std::min(lowest_, entry.owner);
      highest = std::max(highest, entry.owner);
      any_whole_ |= entry.far < 0;
    }
  first_.assign(static_cast<std::size_t>(std::max<std::int64_t>(0, std::int64_t{highest} - lowest_ + 1)) + 1, 0);
  const std::size_t owners = first_.size() - 1;
  const auto place = [&](const Entry& entry) { return static_cast<std::size_t>(entry.owner - lowest_); };
  for (const auto& entries : of_thread_)
    for (const Entry& entry : entries) ++first_[place(entry) + 1];
  for (std::size_t o = 0; o < owners; ++o) first_[o + 1] += first_[o];
  all_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1), left(owners);
  for (const auto& entries : of_thread_)
    for (const Entry& entry : entries) all_[next[place(entry)]++] = entry;
  parallel_for(owners, [&](std::size_t o) {
    // Evaluation points of one bond or point come from one thread, in an order that is always the same.
    Entry *const begin = all_.data() + first_[o], *const end = all_.data() + first_[o + 1], *kept = begin;
    if (!std::ranges::is_sorted(begin, end, {}, &Entry::far)) std::stable_sort(begin, end, [](const Entry& a, const Entry& b) { return a.far < b.far; });
    for (const Entry* entry = begin; entry != end; ++entry) {
      if (kept == begin || kept[-1].far != entry->far) {
        *kept++ = *entry;
        continue;
      }
      Entry& last = kept[-1];
      last.weight += entry->weight;
      last.energy += entry->energy;
      last.pressure += entry->pressure;
      for (int c = 0; c < 9; ++c) last.tensor[c] += entry->tensor[c];
    }
    left[o] = static_cast<std::size_t>(kept - begin);
  });
  std::size_t kept = 0;
  for (std::size_t o = 0; o < owners; ++o) {
    if (kept != first_[o]) std::copy_n(all_.begin() + static_cast<std::ptrdiff_t>(first_[o]), left[o], all_.begin() + static_cast<std::ptrdiff_t>(kept));
    first_[o] = kept;
    kept += left[o];
  }
  first_.back() = kept;
  all_.resize(kept);
}

const BondSamples::Entry* BondSamples::find(std::int32_t owner, std::int32_t far) const noexcept {
  const std::int64_t o = std::int64_t{owner} - lowest_;
  if (o < 0 || o + 1 >= std::ssize(first_)) return nullptr;
  const Entry *const begin = all_.data() + first_[static_cast<std::size_t>(o)],
                     *const end = all_.data() + first_[static_cast<std::size_t>(o) + 1];
  const Entry* const at = std::lower_bound(begin, end, far, [](const Entry& e, std::int32_t key) { return e.far < key; });
  return at != end && at->far == far ? at : nullptr;
}

}  // namespace perikit
