#include "body/partition/block_colours.hpp"

#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// The blocks of a part, by their numbers in the whole body; its own ones follow each other.
struct BlocksOfPart {
  std::vector<std::int64_t> number;
  std::size_t first_own = 0, last_own = 0;

  explicit BlocksOfPart(const Body& part) {
    const std::size_t block = part.block_points();
    for (std::size_t p = 0; p < part.points(); p += block) {
      if (part.owns(p)) {
        if (last_own == 0) first_own = number.size();
        last_own = number.size() + 1;
      }
      number.push_back(part.places().place[p] / static_cast<std::int64_t>(block));
    }
  }
};

/// Of the rank's own blocks, one after the other: how many units of the whole body each touches, and which.
std::vector<std::int64_t> touches_of(const BlocksOfPart& blocks, const Body& part) {
  std::vector<std::int64_t> flat;
  for (const std::vector<std::int32_t>& units : block_reach(part, colour_unit, blocks.first_own, blocks.last_own)) {
    flat.push_back(std::ssize(units));
    for (const std::int32_t unit : units)
      flat.push_back(part.places().place[static_cast<std::size_t>(unit) * colour_unit] / static_cast<std::int64_t>(colour_unit));
  }
  return flat;
}

/// values <- those of `from` on `to`, which has made room for them. All ranks must call it.
void tell(int from, int to, std::vector<std::int64_t>& values) {
  static_assert(sizeof(std::int64_t) == sizeof(double));
  const int me = communicator().rank();
  std::vector<Message> messages;
  auto* const bits = reinterpret_cast<double*>(values.data());
  if (from != to && me == from) messages.push_back({to, {bits, values.size()}, {}});
  if (from != to && me == to) messages.push_back({from, {}, {bits, values.size()}});
  communicator().exchange(messages);
}

/// Colours of the rank's own blocks. Rank 0 has the touches of one rank at a time.
std::vector<std::int64_t> own_colours(std::vector<std::int64_t> touches, std::size_t blocks, std::size_t units) {
  const int me = communicator().rank();
  const std::vector<std::int64_t> mine{std::ssize(touches), static_cast<std::int64_t>(blocks)};
  const std::vector<std::int64_t> sizes = gathered<std::int64_t>(mine);
  FreeColours free(units);
  std::vector<std::int64_t> colours;
  for (int r = 0; r < communicator().size(); ++r) {
    std::vector<std::int64_t> theirs, found;
    if (me == r) theirs = std::move(touches), found.resize(blocks);
    if (me == 0 && r > 0) theirs.resize(static_cast<std::size_t>(sizes[2 * static_cast<std::size_t>(r)]));
    tell(r, 0, theirs);
    if (me == 0) {
      found.clear();
      for (std::span<const std::int64_t> left(theirs); !left.empty();) {
        const auto count = static_cast<std::size_t>(left.front());
        found.push_back(free.next(left.subspan(1, count)));
        left = left.subspan(1 + count);
      }
    }
    tell(0, r, found);
    if (me == r) colours = std::move(found);
  }
  return colours;
}

}  // namespace

void fill_blocks(std::size_t block, std::vector<std::uint8_t>& marked) {
  for (std::size_t b = 0; b < marked.size(); b += block) {
    const auto begin = marked.begin() + static_cast<std::ptrdiff_t>(b),
               end = marked.begin() + static_cast<std::ptrdiff_t>(std::min(marked.size(), b + block));
    if (std::find(begin, end, 1) != end) std::fill(begin, end, std::uint8_t{1});
  }
}

void colour_blocks(const CurveShares& pieces, Body& part) {
  if (!communicator().complete()) return;
  const auto size = static_cast<std::size_t>(communicator().size());
  const BlocksOfPart blocks(part);
  const std::vector<std::int64_t> own =
      own_colours(touches_of(blocks, part), blocks.last_own - blocks.first_own,
                  static_cast<std::size_t>(pieces.blocks() * pieces.block()) / colour_unit);
  std::vector<std::vector<std::int64_t>> wanted(size);
  for (const std::int64_t number : blocks.number)
    wanted[static_cast<std::size_t>(pieces.owner_of_block(number))].push_back(number);
  std::vector<std::vector<std::int64_t>> given = exchanged(wanted);
  for (std::vector<std::int64_t>& numbers : given)
    for (std::int64_t& number : numbers) number = own[static_cast<std::size_t>(number - blocks.number[blocks.first_own])];
  std::vector<std::int32_t> colours;  // owners follow each other as blocks do
  for (const std::vector<std::int64_t>& of_owner : exchanged(given))
    colours.insert(colours.end(), of_owner.begin(), of_owner.end());
  part.set_block_colours(std::move(colours));
}

}  // namespace perikit
