#pragma once
/// Values of a plain type that ranks tell each other.

#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "perikit/core/communicator.hpp"

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

}  // namespace perikit
