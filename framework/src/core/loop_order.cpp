#include "core/loop_order.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "core/loop_shares.hpp"

namespace perikit {

namespace {
constexpr std::int64_t nothing = std::numeric_limits<std::int64_t>::max();
}  // namespace

LoopOrder::LoopOrder(std::shared_ptr<const LoopWaits> waits_for, std::vector<std::uint8_t> late)
    : waits_for_(std::move(waits_for)),
      followers_(size()),
      late_(std::move(late)),
      early_(size() - static_cast<std::size_t>(std::ranges::count(late_, std::uint8_t{1}))),
      awaited_(std::make_unique<std::atomic<std::int32_t>[]>(size())) {
  for (std::size_t i = 0; i < size(); ++i)
    for (const std::int32_t other : (*waits_for_)[i]) followers_[static_cast<std::size_t>(other)].push_back(static_cast<std::int32_t>(i));
}

const std::vector<std::int32_t>& LoopOrder::turns() {
  if (turns_.empty()) begin(1);
  while (turns_.size() < size()) {
    turns_.push_back(static_cast<std::int32_t>(take(0).value()));
    end(static_cast<std::size_t>(turns_.back()));
  }
  return turns_;
}

std::int64_t LoopOrder::key(std::size_t i) const noexcept {
  return static_cast<std::int64_t>(late_.empty() || late_[i] == 0 ? i : i + size());
}

void LoopOrder::divide(int threads) {
  threads_ = static_cast<std::size_t>(threads);
  shares_ = std::make_unique<Share[]>(threads_);
  std::vector<std::size_t> of_thread(threads_, 0);
  for (std::size_t i = 0; i < size(); ++i) {
    Share& share = shares_[detail::share_of(i, size(), threads_)];
    ++of_thread[detail::share_of(i, size(), threads_)];
    if ((*waits_for_)[i].empty()) share.at_once.push_back(key(i));
  }
  for (std::size_t t = 0; t < threads_; ++t) {
    std::ranges::sort(shares_[t].at_once);   // which is a heap, too
    shares_[t].keys.reserve(of_thread[t]);
  }
}

void LoopOrder::begin(int threads) {
  if (threads_ != static_cast<std::size_t>(threads)) divide(threads);
  taken_.store(0, std::memory_order_relaxed);
  for (std::size_t i = 0; i < size(); ++i) awaited_[i].store(static_cast<std::int32_t>((*waits_for_)[i].size()), std::memory_order_relaxed);
  for (std::size_t t = 0; t < threads_; ++t) {
    Share& share = shares_[t];
    share.keys = share.at_once;
    share.first.store(share.keys.empty() ? nothing : share.keys.front(), std::memory_order_relaxed);
  }
}

std::optional<std::size_t> LoopOrder::take_of(Share& share, std::int64_t bound) noexcept {
  if (share.first.load(std::memory_order_relaxed) >= bound) return {};
  const detail::Locked locked(share.locked);
  if (share.keys.empty() || share.keys.front() >= bound) return {};
  const auto i = static_cast<std::size_t>(share.keys.front());
  std::ranges::pop_heap(share.keys, std::greater<>());
  share.keys.pop_back();
  share.first.store(share.keys.empty() ? nothing : share.keys.front(), std::memory_order_relaxed);
  taken_.fetch_add(1, std::memory_order_acq_rel);
  return i < size() ? i : i - size();
}

std::optional<std::size_t> LoopOrder::take(int thread, bool late) noexcept {
  const auto bound = static_cast<std::int64_t>(late ? 2 * size() : size());
  const std::size_t shares = detail::threads_keep_to_themselves ? 1 : threads_;
  for (std::size_t k = 0; k < shares; ++k)
    if (const auto i = take_of(shares_[(static_cast<std::size_t>(thread) + k) % threads_], bound)) return i;
  return {};
}

void LoopOrder::may_begin(std::size_t i) noexcept {
  Share& share = shares_[detail::share_of(i, size(), threads_)];
  const detail::Locked locked(share.locked);
  share.keys.push_back(key(i));
  std::ranges::push_heap(share.keys, std::greater<>());
  share.first.store(share.keys.front(), std::memory_order_relaxed);
}

/// What the index wrote is seen by whoever takes one that waited for it.
void LoopOrder::end(std::size_t i) noexcept {
  for (const std::int32_t follower : followers_[i])
    if (awaited_[static_cast<std::size_t>(follower)].fetch_sub(1, std::memory_order_acq_rel) == 1) may_begin(static_cast<std::size_t>(follower));
}

}  // namespace perikit
