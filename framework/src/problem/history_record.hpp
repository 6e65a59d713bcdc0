#pragma once
/// What laws remember in the snapshots of a run: by what evaluation points are in the whole body, so that any number of ranks goes on from it.

#include <vector>

#include "perikit/operators/law_history.hpp"
#include "perikit/terms/terms.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

struct HistoryRecord {
  std::size_t components = 0;         ///< numbers an evaluation point
  std::vector<HistoryPoint> points;   ///< of all ranks, ascending
  std::vector<double> values;         ///< `components` numbers a point

  /// Of the present state, on rank 0; without points on the others. All ranks must call it.
  static HistoryRecord of(const Terms& terms);
  /// Becomes the history of all evaluation points of this rank. Throws InputError where it lacks one of them, or belongs to other laws.
  void restore(Terms& terms) const;

  void write(ByteWriter& out) const;
  static HistoryRecord read(ByteReader& in);
};

}  // namespace perikit
