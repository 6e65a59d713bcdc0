#include "perikit/core/point_motion.hpp"

#include <algorithm>

#include "core/threads/work_stealing.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

PointMotion::PointMotion(std::size_t points, std::size_t many)
    : points_(points),
      pieces_((points + piece_points - 1) / piece_points),
      inside_(points >= many),
      progress_(std::make_unique<std::atomic<std::uint8_t>[]>(pieces_)),
      moved_{pieces_} {}

void PointMotion::expect() noexcept {
  for (std::size_t i = 0; i < pieces_; ++i) progress_[i].store(waiting, std::memory_order_relaxed);
  moved_.pieces.store(0, std::memory_order_release);
}

bool PointMotion::take(std::size_t i) noexcept {
  std::uint8_t found = progress_[i].load(std::memory_order_relaxed);
  return found == waiting && progress_[i].compare_exchange_strong(found, moving, std::memory_order_relaxed);
}

void PointMotion::move_taken(std::size_t first, std::size_t last) noexcept {
  move(first * piece_points, std::min(points_, last * piece_points));
  for (std::size_t i = first; i < last; ++i) progress_[i].store(moved, std::memory_order_release);
  moved_.pieces.fetch_add(last - first, std::memory_order_acq_rel);
}

void PointMotion::need(std::span<const std::int32_t> pieces) noexcept {
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const auto first = static_cast<std::size_t>(pieces[k]);
    if (!take(first)) continue;
    std::size_t last = first + 1;   // neighbours go together
    for (; k + 1 < pieces.size() && static_cast<std::size_t>(pieces[k + 1]) == last && take(last); ++k) ++last;
    move_taken(first, last);
  }
  // What others move they are soon done with: they wait for nothing.
  for (const std::int32_t i : pieces)
    for (detail::Patience patience; progress_[static_cast<std::size_t>(i)].load(std::memory_order_acquire) != moved;) patience.wait();
}

void PointMotion::finish() noexcept {
  if (!pending()) return;
  over_blocks(points_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin / piece_points, last = (end + piece_points - 1) / piece_points; i < last; ++i) {
      const std::size_t first = i;
      while (i < last && take(i)) ++i;
      if (i > first) move_taken(first, i);
    }
  });
}

}  // namespace perikit
