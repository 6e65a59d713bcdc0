#pragma once
/// Points that move as a loop over them begins, each right before the loop reads it for the first time: what was written is in the caches then, and
/// a step of an explicit scheme has one loop less.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace perikit {

/// Displacements that are computed in pieces of so many points: once each, by the thread that needs a piece first.
class PointMotion {
 public:
  static constexpr std::size_t piece_points = 128;
  /// From so many points on their fields fit into no cache: fewer are moved sooner in a loop of their own.
  static constexpr std::size_t many_points = 1000000;

  virtual ~PointMotion() = default;
  PointMotion(const PointMotion&) = delete;
  PointMotion& operator=(const PointMotion&) = delete;

  /// Whether points have not moved yet.
  bool pending() const noexcept { return moved_.pieces.load(std::memory_order_acquire) < pieces_; }
  /// Whether points are to move inside of the loop that reads them.
  bool inside() const noexcept { return inside_; }
  /// The points of these pieces, ascending, have moved when it returns; from any thread of a loop.
  void need(std::span<const std::int32_t> pieces) noexcept;
  /// All points have moved when it returns. Not inside of a loop.
  void finish() noexcept;

 protected:
  /// Of the points [0, points), which have moved until `expect`; inside of loops where they are at least `many`.
  explicit PointMotion(std::size_t points, std::size_t many = many_points);
  /// They are to move from now on.
  void expect() noexcept;

 private:
  enum Progress : std::uint8_t { waiting, moving, moved };
  /// Moves the points [begin, end), on any thread, whatever others move meanwhile.
  virtual void move(std::size_t begin, std::size_t end) noexcept = 0;
  /// Whether this thread is the one that moves a piece.
  bool take(std::size_t i) noexcept;
  void move_taken(std::size_t first, std::size_t last) noexcept;

  std::size_t points_, pieces_;
  bool inside_;
  std::unique_ptr<std::atomic<std::uint8_t>[]> progress_;   ///< by piece
  /// Threads write it while others read what lies around it.
  struct alignas(64) Counter {
    std::atomic<std::size_t> pieces;
  };
  Counter moved_;
};

}  // namespace perikit
