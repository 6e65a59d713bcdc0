#pragma once
/// Values of a plain type that ranks tell each other.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

/// On rank 0 those of all ranks, rank by rank; none on the others. All ranks must call it.
template <class T>
std::vector<T> gathered(std::span<const T> mine) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<T> all;
  for (const std::vector<std::byte>& of_rank : communicator().gather(std::as_bytes(mine))) {
    const std::size_t before = all.size();
    all.resize(before + of_rank.size() / sizeof(T));
    if (!of_rank.empty()) std::memcpy(all.data() + before, of_rank.data(), of_rank.size());
  }
  return all;
}

/// Those of rank 0. All ranks must call it.
template <class T>
std::vector<T> told_to_all(const std::vector<T>& mine) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto own = std::as_bytes(std::span(mine));
  std::vector<std::byte> bytes(own.begin(), own.end());
  communicator().broadcast(bytes);
  std::vector<T> told(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(told.data(), bytes.data(), bytes.size());
  return told;
}

/// From each rank what it has for this one; to: for each of them. All ranks must call it.
template <class T>
std::vector<std::vector<T>> exchanged(const std::vector<std::vector<T>>& to) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(double) == 0);
  constexpr std::size_t width = sizeof(T) / sizeof(double);  // messages are made of doubles, whose bits nobody looks at
  const std::size_t size = to.size(), me = static_cast<std::size_t>(communicator().rank());
  std::vector<double> given(size), wanted(size, 0.0);
  std::vector<Message> messages;
  for (std::size_t k = 0; k < size; ++k) {
    given[k] = static_cast<double>(to[k].size());
    if (k != me) messages.push_back({static_cast<int>(k), {&given[k], 1}, {&wanted[k], 1}});
  }
  communicator().exchange(messages);
  messages.clear();
  std::vector<std::vector<T>> from(size);
  from[me] = to[me];
  for (std::size_t k = 0; k < size; ++k) {
    if (k == me) continue;
    from[k].resize(static_cast<std::size_t>(wanted[k]));
    if (to[k].empty() && from[k].empty()) continue;
    messages.push_back({static_cast<int>(k),
                        {reinterpret_cast<const double*>(to[k].data()), to[k].size() * width},
                        {reinterpret_cast<double*>(from[k].data()), from[k].size() * width}});
  }
  communicator().exchange(messages);
  return from;
}

/// How many things lower ranks have, and all of them. All ranks must call it.
struct Counted {
  std::int64_t before = 0, all = 0;
};
inline Counted counted(std::int64_t mine) {
  const Communicator& ranks = communicator();
  if (!ranks.complete()) return {0, mine};
  std::vector<std::int64_t> of_rank(static_cast<std::size_t>(ranks.size()), 0);
  of_rank[static_cast<std::size_t>(ranks.rank())] = mine;
  communicator().sum(of_rank);
  Counted counted;
  for (std::size_t k = 0; k < of_rank.size(); ++k) {
    if (static_cast<int>(k) < ranks.rank()) counted.before += of_rank[k];
    counted.all += of_rank[k];
  }
  return counted;
}

/// The run of so many things that is this rank's, one rank's after the other's; a rank without others has all.
struct Run {
  std::int64_t first = 0, last = 0;
};
inline Run own_run(std::int64_t count) {
  const Communicator& ranks = communicator();
  if (!ranks.complete()) return {0, count};
  const std::int64_t rank = ranks.rank(), size = ranks.size(), longer = count % size;
  const auto first = [&](std::int64_t r) { return count / size * r + std::min(r, longer); };
  return {first(rank), first(rank + 1)};
}

/// Whose run holds which number, where each rank's begins at `first`. All ranks must make one.
class RunOwners {
 public:
  explicit RunOwners(std::int64_t first) : firsts_(told_to_all(gathered<std::int64_t>({&first, 1}))) {}
  std::size_t owner(std::int64_t number) const {
    if (!communicator().complete()) return static_cast<std::size_t>(communicator().rank());
    return static_cast<std::size_t>(std::ranges::upper_bound(firsts_, number) - firsts_.begin() - 1);
  }

 private:
  std::vector<std::int64_t> firsts_;
};

/// Does the work, and throws on all ranks what the lowest of those that failed at it has thrown: an InputError. All ranks must
/// call it.
template <class Work>
auto agreed(Work&& work) {
  std::optional<decltype(work())> result;
  std::string failure;
  try {
    result = work();
  } catch (const InputError& error) {
    failure = error.what();
  }
  if (const std::string first = first_message(failure); !first.empty()) throw InputError(first);
  return std::move(*result);
}

}  // namespace perikit
