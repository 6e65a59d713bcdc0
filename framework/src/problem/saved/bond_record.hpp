#pragma once
/// Bonds that have failed or weakened in the snapshots of a run: by what they are in the whole body, so that any number of ranks goes on from it.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fracture/fracture.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

/// Those of all ranks with the account of their failures, a piece at a time. All ranks must call what is here, and read the same. Where bonds never fail (null)
/// there are none.
class BondRecord {
 public:
  /// Of the present state.
  explicit BondRecord(const Fracture* fracture);
  /// Bytes that `write` makes.
  std::uint64_t written() const noexcept;
  /// To rank 0; what the others write is worth nothing.
  void write(ByteWriter& out) const;

  static void read(ByteReader& in, Fracture* fracture);
  /// Of what `write` made, the bonds alone: use(some of them) until all have come.
  static void read_bonds(ByteReader& in, const std::function<void(std::span<const NamedChange>)>& use);

  // The same of this rank alone, with its ghosts.
  static void write_here(const Fracture* fracture, ByteWriter& out);
  static void read_here(ByteReader& in, Fracture* fracture);

 private:
  BondAccount account_;
  std::vector<NamedChange> mine_;  ///< that no other rank owns
  std::uint64_t of_all_;           ///< number
};

}  // namespace perikit
