#pragma once
/// Rows of numbered things that lie on several ranks, in the order of their numbers, a piece at a time. Ranks send which runs of
/// numbers they have with the rows: nobody keeps who has what.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace perikit {

/// Of the things numbers[from] ... numbers[to - 1] of this rank, `width` numbers each.
using RowsOf = std::function<std::span<const double>(std::size_t from, std::size_t to)>;

/// What this rank has of `count` rows from number `first` on, as words to send; its numbers ascend.
std::vector<std::int64_t> own_share(std::span<const std::int64_t> numbers, std::size_t first, std::size_t count,
                                    const RowsOf& rows_of);
/// Puts what a rank has into its places among the rows of the piece.
void unpack_share(std::span<const std::byte> share, std::size_t width, std::span<double> rows);
/// Those rows on rank 0, 0 where nobody has one; empty on the others. All ranks must call it.
std::vector<double> gather_piece(std::span<const std::int64_t> numbers, std::size_t first, std::size_t count, std::size_t width,
                                 const RowsOf& rows_of);

/// Rows that are sent at a time.
inline constexpr std::size_t rows_of_piece = std::size_t{1} << 17;

}  // namespace perikit
