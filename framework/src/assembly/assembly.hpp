#pragma once
/// Assembled tangents: K = sum_q W_q g_q . A(F_q) . g_q with the evaluation points and stencils of the spaces, never by probing.

#include <mutex>

#include "assembly/block_rows.hpp"
#include "core/per_thread.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/model/configuration.hpp"

namespace perikit {

/// What one term adds to a tangent.
class Assembly {
 public:
  virtual ~Assembly() = default;
  /// Adds -d(force)/du to the values of K, whose pattern couples all rows that need it. Returns the field index of the first inadmissible
  /// point, or -1.
  virtual std::int64_t add(const Configuration& at, BlockMatrix& K) = 0;
  /// What is kept from one assembly to the next and depends on bonds is to be made anew.
  virtual void bonds_changed() = 0;
  /// Kept from one assembly to the next.
  virtual std::size_t bytes() const noexcept = 0;
};

/// First inadmissible point of loops over blocks: the smallest field index that any thread reports.
class FirstBad {
 public:
  void report(std::int64_t point) {
    const std::lock_guard lock(guard_);
    if (point_ < 0 || point < point_) point_ = point;
  }
  std::int64_t point() const noexcept { return point_; }

 private:
  std::mutex guard_;
  std::int64_t point_ = -1;
};

}  // namespace perikit
