#pragma once
/// LawHistory of laws at the evaluation points of one space.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>

#include "perikit/core/field.hpp"

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

/// Evaluation points have stable numbers q: component c of the history at q is [c * stride + q]. Fresh history is zero.
class LawHistory {
 public:
  /// components: doubles per evaluation point, the most that any law of the body needs; numbers: all q lie below.
  LawHistory(int components, std::size_t numbers)
      : components_(static_cast<std::size_t>(components)), stride_(padded(numbers)), begin_(components_ * stride_, 0.0), end_(begin_) {}

  std::size_t components() const noexcept { return components_; }
  std::size_t stride() const noexcept { return stride_; }
  /// At the beginning of the step, and what an evaluation that ends it puts aside.
  const double* begin() const noexcept { return begin_.data(); }
  double* end() noexcept { return end_.data(); }

  /// The step is done: what the last evaluation put aside is the history from now on.
  void advance() noexcept { begin_.swap(end_); }

  /// All that a run continues from.
  std::span<double> values() noexcept { return begin_; }
  std::span<const double> values() const noexcept { return begin_; }
  std::size_t bytes() const noexcept { return 2 * begin_.size() * sizeof(double); }

 private:
  std::size_t components_, stride_;
  AlignedVector<double> begin_, end_;
};

}  // namespace perikit
