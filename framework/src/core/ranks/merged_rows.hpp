#pragma once
/// Rows of keyed things that lie on several ranks, in the order of their keys, a piece at a time: nobody has all of them.

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

#include "core/ranks/numbered_rows.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

/// use(keys, rows) on rank 0, piece by piece: the keys of all ranks in ascending order, with `width` numbers each. The keys of
/// each rank ascend, and no two ranks have the same. A piece has at most `most` keys, or one of each rank. All ranks must call
/// it.
template <class Key, class Use>
void over_merged_rows(std::span<const Key> keys, std::size_t width, const RowsOf& rows_of, Use&& use,
                      std::size_t most = rows_of_piece) {
  const std::size_t share = std::max<std::size_t>(1, most / static_cast<std::size_t>(communicator().size()));
  std::size_t from = 0;
  for (bool more = true; more;) {
    // Each rank has a share ready; nobody sends what comes after the end of the share of another one.
    std::vector<Key> last = gathered<Key>(keys.size() - from > share ? keys.subspan(from + share - 1, 1) : keys.first(0));
    if (!last.empty()) last = {*std::min_element(last.begin(), last.end())};
    last = told_to_all(last);
    more = !last.empty();
    const auto begin = keys.begin() + static_cast<std::ptrdiff_t>(from);
    const std::size_t count =
        static_cast<std::size_t>((more ? std::upper_bound(begin, keys.end(), last.front()) : keys.end()) - begin);
    const std::vector<Key> all = gathered<Key>(keys.subspan(from, count));
    const std::vector<double> rows = width > 0 ? gathered<double>(rows_of(from, from + count)) : std::vector<double>();
    from += count;
    if (communicator().rank() != 0) continue;
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return all[a] < all[b]; });
    std::vector<Key> sorted;
    std::vector<double> of_sorted(rows.size());
    for (const std::size_t n : order) {
      std::copy_n(rows.data() + n * width, width, of_sorted.data() + sorted.size() * width);
      sorted.push_back(all[n]);
    }
    use(std::span<const Key>(sorted), std::span<const double>(of_sorted));
  }
}

/// Of keys alone.
template <class Key, class Use>
void over_merged(std::span<const Key> keys, Use&& use) {
  over_merged_rows(keys, 0, {}, [&](std::span<const Key> piece, std::span<const double>) { use(piece); });
}

}  // namespace perikit
