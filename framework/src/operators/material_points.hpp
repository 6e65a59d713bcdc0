#pragma once
/// The laws of a body at the evaluation points of one space, and what they remember there.

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// What an evaluation point is in the whole body, whatever part of it a rank has.
struct HistoryPoint {
  std::int64_t owner;  ///< place in the whole body
  std::int64_t far;    ///< of a bond the place of its other end; else -1
  std::int64_t which;  ///< of several between the same points
  auto operator<=>(const HistoryPoint&) const = default;
};
/// Where its history is.
struct HistoryPlace {
  HistoryPoint point;
  std::int64_t number;
  bool own;   ///< no other rank owns it
};

/// Evaluation points have stable numbers q: component c of the state at q is [c * stride + q]. All begins at zero. An evaluation that ends a step reads
/// the state at its beginning and writes that at its end, which becomes the beginning of the next one where the step is accepted.
class MaterialPoints {
 public:
  /// numbers: all q lie below.
  MaterialPoints(const Laws& laws, std::size_t numbers)
      : laws_(laws),
        components_(static_cast<std::size_t>(laws.state_components())),
        stride_(components_ > 0 ? padded(numbers) : 0),
        begin_(components_ * stride_, 0.0),
        end_(begin_) {}

  const Laws& laws() const noexcept { return laws_; }
  /// Some law remembers something.
  bool remember() const noexcept { return components_ > 0; }
  std::size_t components() const noexcept { return components_; }
  std::size_t stride() const noexcept { return stride_; }
  const double* begin() const noexcept { return begin_.data(); }
  double* end() noexcept { return end_.data(); }
  /// values[c * batch_points + l] <- the state at the beginning of the step of these points, of lanes l in turn; 0 where a number is -1.
  void gather(std::span<const std::int64_t> numbers, double* values) const noexcept {
    for (std::size_t c = 0; c < components_; ++c)
      for (std::size_t l = 0; l < numbers.size(); ++l)
        values[c * batch_points + l] = numbers[l] < 0 ? 0.0 : begin_[c * stride_ + static_cast<std::size_t>(numbers[l])];
  }

  /// A step that was too long for the law of an evaluation point.
  struct TooLong {
    std::int64_t number;
    double factor;    ///< the share of its length that the law asks for
    bool at_rest;     ///< where H is exactly zero, perhaps because no bond is left that could deform it
  };
  /// From any thread.
  void ask_for(const TooLong& asked) {
    const std::lock_guard lock(guard_);
    const auto least = std::ranges::find(too_long_, false, &TooLong::at_rest);   // of those that move the least is enough
    if (asked.at_rest || least == too_long_.end()) too_long_.push_back(asked);
    else if (asked.factor < least->factor || (asked.factor == least->factor && asked.number < least->number)) *least = asked;
  }
  /// What laws have asked for since this was called last.
  std::vector<TooLong> take_too_long() noexcept { return std::exchange(too_long_, {}); }

  /// An evaluation of the whole body has written the end of a step.
  void step_ended() noexcept { ended_ = true; }
  /// The step that ended is done: its end is the beginning from now on. Nothing where none has ended since the last one.
  void accept() noexcept {
    if (ended_) begin_.swap(end_);
    ended_ = false;
  }
  /// The step is given up.
  void revert() noexcept { ended_ = false; }

  /// All that a run continues from: the beginning of the step.
  std::span<double> values() noexcept { return begin_; }
  std::span<const double> values() const noexcept { return begin_; }
  std::size_t bytes() const noexcept { return 2 * begin_.size() * sizeof(double); }

 private:
  const Laws& laws_;
  std::size_t components_, stride_;
  AlignedVector<double> begin_, end_;
  bool ended_ = false;
  std::mutex guard_;
  std::vector<TooLong> too_long_;
};

}  // namespace perikit
