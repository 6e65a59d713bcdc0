#include "core/threads/loop_order.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

#include "core/threads/work_stealing.hpp"

namespace perikit {

LoopOrder::LoopOrder(std::shared_ptr<const LoopWaits> waits_for, std::vector<std::uint8_t> late)
    : waits_for_(std::move(waits_for)),
      followers_(size()),
      late_(std::move(late)),
      early_(size() - static_cast<std::size_t>(std::ranges::count(late_, std::uint8_t{1}))),
      awaited_(std::make_unique<std::atomic<std::int32_t>[]>(size())) {
  for (std::size_t i = 0; i < size(); ++i)
    for (const std::int32_t other : (*waits_for_)[i]) followers_[static_cast<std::size_t>(other)].push_back(static_cast<std::int32_t>(i));
}

/// As if all took equally long: again and again the lowest ones that may begin, then what waited for them; late ones after all others. As many at a
/// time as leave each of several threads several to do meanwhile.
std::vector<std::int32_t> LoopOrder::turns_of(std::size_t threads) const {
  std::vector<std::size_t> awaited;
  for (const std::vector<std::int32_t>& others : *waits_for_) awaited.push_back(others.size());
  std::priority_queue<std::int32_t, std::vector<std::int32_t>, std::greater<>> ready;
  for (std::size_t i = 0; i < size(); ++i)
    if (awaited[i] == 0) ready.push(static_cast<std::int32_t>(i));
  std::vector<std::int32_t> turns;
  while (!ready.empty()) {
    const std::size_t begin = turns.size();
    for (; turns.size() < begin + threads * threads && !ready.empty(); ready.pop()) turns.push_back(ready.top());
    for (std::size_t k = begin; k < turns.size(); ++k)
      for (const std::int32_t follower : followers_[static_cast<std::size_t>(turns[k])])
        if (--awaited[static_cast<std::size_t>(follower)] == 0) ready.push(follower);
  }
  if (!late_.empty()) std::stable_partition(turns.begin(), turns.end(), [&](std::int32_t i) { return late_[static_cast<std::size_t>(i)] == 0; });
  return turns;
}

void LoopOrder::divide(int threads) {
  threads_ = static_cast<std::size_t>(threads);
  turns_ = turns_of(threads_);
  place_.resize(size());
  for (std::size_t k = 0; k < size(); ++k) place_[static_cast<std::size_t>(turns_[k])] = static_cast<std::int32_t>(k);
  shares_ = std::make_unique<Share[]>(threads_);
  std::vector<std::size_t> of_thread(threads_, 0);
  for (std::size_t i = 0; i < size(); ++i) {
    const std::size_t t = detail::share_of(i, size(), threads_);
    ++of_thread[t];
    if ((*waits_for_)[i].empty()) shares_[t].at_once.push_back(place_[i]);
  }
  for (std::size_t t = 0; t < threads_; ++t) {
    std::ranges::sort(shares_[t].at_once);   // which is a heap, too
    shares_[t].ready.reserve(of_thread[t]);
  }
}

const std::vector<std::int32_t>& LoopOrder::turns() {
  if (threads_ != 1) divide(1);
  return turns_;
}

void LoopOrder::begin(int threads) {
  if (threads_ != static_cast<std::size_t>(threads)) divide(threads);
  taken_.store(0, std::memory_order_relaxed);
  for (std::size_t i = 0; i < size(); ++i) awaited_[i].store(static_cast<std::int32_t>((*waits_for_)[i].size()), std::memory_order_relaxed);
  for (std::size_t t = 0; t < threads_; ++t) {
    Share& share = shares_[t];
    share.ready = share.at_once;
    share.show();
  }
}

std::optional<std::size_t> LoopOrder::take_of(Share& share, std::size_t bound) noexcept {
  if (share.first.load(std::memory_order_relaxed) >= bound) return {};
  const detail::Locked locked(share.locked);
  const std::size_t place = share.first.load(std::memory_order_relaxed);
  if (place >= bound) return {};
  std::ranges::pop_heap(share.ready, std::greater<>());
  share.ready.pop_back();
  share.show();
  taken_.fetch_add(1, std::memory_order_acq_rel);
  return static_cast<std::size_t>(turns_[place]);
}

std::optional<std::size_t> LoopOrder::take(int thread, bool late) noexcept {
  const std::size_t bound = late ? size() : early_;
  const std::size_t shares = detail::threads_keep_to_themselves ? 1 : threads_;
  for (std::size_t k = 0; k < shares; ++k)
    if (const auto i = take_of(shares_[(static_cast<std::size_t>(thread) + k) % threads_], bound)) return i;
  return {};
}

void LoopOrder::may_begin(std::size_t i) noexcept {
  Share& share = shares_[detail::share_of(i, size(), threads_)];
  const detail::Locked locked(share.locked);
  share.ready.push_back(place_[i]);
  std::ranges::push_heap(share.ready, std::greater<>());
  share.show();
}

/// What the index wrote is seen by whoever takes one that waited for it.
void LoopOrder::end(std::size_t i) noexcept {
  for (const std::int32_t follower : followers_[i])
    if (awaited_[static_cast<std::size_t>(follower)].fetch_sub(1, std::memory_order_acq_rel) == 1) may_begin(static_cast<std::size_t>(follower));
}

}  // namespace perikit
