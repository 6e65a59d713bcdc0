#pragma once
/// What laws remember in the snapshots of a run: by what evaluation points are in the whole body, so that any number of ranks goes on from it.

#include <cstdint>
#include <vector>

#include "operators/material_points.hpp"
#include "problem/snapshot.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// That of all ranks, ascending by evaluation points: these first, then their values, a piece at a time. All ranks must call what
/// is here, and read the same.
class HistoryRecord {
 public:
  /// Of the present state. `terms` must outlive it.
  explicit HistoryRecord(const Terms& terms);
  /// Bytes that `write` makes.
  std::uint64_t written() const;
  /// To rank 0; what the others write is worth nothing.
  void write(ByteWriter& out) const;

  /// Becomes the history of all evaluation points of this rank. Throws InputError where it lacks one of them, or belongs to other laws.
  static void read(ByteReader& in, Terms& terms);
  /// How many values there are, which are left where they are.
  static std::size_t count(ByteReader& in);

  // The same of this rank alone.
  static void write_here(const Terms& terms, ByteWriter& out);
  static void read_here(ByteReader& in, Terms& terms);

 private:
  const MaterialPoints* history_;
  std::size_t components_;            ///< numbers an evaluation point
  std::vector<HistoryPoint> points_;  ///< those that no other rank has
  std::vector<std::int64_t> numbers_;
  std::uint64_t points_of_all_ = 0;
};

}  // namespace perikit
