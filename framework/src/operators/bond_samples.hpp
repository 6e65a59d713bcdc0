#pragma once
/// What evaluation points hold, by the bond or the point that they belong to: what damage criteria look at beside the stretch.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "operators/batch.hpp"

namespace perikit {

class BondSamples {
 public:
  /// Of the directed bond from owner to far, or of the owner as a whole (far = -1).
  struct Entry {
    std::int32_t owner, far;
    double weight;     ///< sum W_q [m^3]
    double energy;     ///< sum W_q psi_q [J]
    double stress[6];  ///< sum W_q sigma_q: xx yy zz xy xz yz
  };

  BondSamples(Space space, bool stress) : space_(space), stress_(stress) {}
  bool stress() const noexcept { return stress_; }

  /// Before a parallel loop: empties all. Of directed bonds only those with an end in a group of `kept` are kept, by group of
  /// eight points; empty: all.
  void clear(std::span<const std::uint8_t> kept);
  /// Whether bonds of the points of this group are kept whatever their other ends.
  bool keeps_group(std::size_t group) const noexcept { return kept_.empty() || kept_[group]; }
  /// The n lanes of a batch with their owners and far ends (-1: of the owner as a whole), after an evaluation with Work::sample.
  void add(int n, const BatchScratch& s);
  void add(const Entry& entry);
  /// After the loops: in ascending order, each owner and far end once, whatever thread they came from.
  void merge();
  /// Nothing belongs to points as a whole.
  bool of_bonds_alone() const noexcept { return !any_whole_; }
  const Entry* find(std::int32_t owner, std::int32_t far) const noexcept;
  std::span<const Entry> entries() const noexcept { return all_; }
  std::size_t bytes() const noexcept { return all_.capacity() * sizeof(Entry); }

 private:
  bool keeps(std::int32_t owner, std::int32_t far) const noexcept {
    return far < 0 || keeps_group(static_cast<std::size_t>(owner) / padding) || keeps_group(static_cast<std::size_t>(far) / padding);
  }

  Space space_;
  bool stress_;
  std::span<const std::uint8_t> kept_;
  std::vector<std::vector<Entry>> of_thread_;
  std::vector<Entry> all_;
  bool any_whole_ = false;
  std::int32_t lowest_ = 0;          ///< owner
  std::vector<std::size_t> first_;   ///< by owner less the lowest: its first entry, and the end of the last one's
};

}  // namespace perikit
