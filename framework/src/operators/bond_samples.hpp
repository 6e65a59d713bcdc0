#pragma once
/// What evaluation points hold, by the bond or the point that they belong to: what damage criteria look at beside the stretch.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "operators/batch.hpp"

namespace perikit {

/// Beside energies: nothing; Cauchy stresses; or derivatives of the energy by the gradients.
enum class BondSampling { energy, stress, derivative };

class BondSamples {
 public:
  /// Of the directed bond from owner to far, of the owner as a whole (far = -1), or of a part of its family.
  struct Entry {
    std::int32_t owner, far;
    double weight = 0;  ///< sum W_q [m^3]
    double energy = 0;  ///< sum W_q psi_q [J]
    /// stress: sum W_q sigma_q, xx yy zz xy xz yz. derivative: dE/dH by the gradient of the space, [c * dimension + e].
    double tensor[9] = {};
    double pressure = 0;  ///< derivative, selective map: sum W_q p/3 (maps/selective_map.hpp)
    double growth = 0;    ///< likewise, a - 1 of the evaluation point
  };

  /// What stands for the far end of the evaluation point of part k of the owner's family.
  static constexpr std::int32_t part(int k) noexcept { return -2 - k; }

  BondSamples(Space space, BondSampling what) : space_(space), what_(what) {}
  BondSampling what() const noexcept { return what_; }
  /// From the next `clear` on.
  void ask(BondSampling what) noexcept { what_ = what; }

  /// Before a parallel loop: empties all. Of directed bonds only those with an end in `kept` (GroupMarks) are kept; empty: all.
  void clear(std::span<const std::uint8_t> kept);
  /// Whether bonds of points of this group are kept whatever their other ends.
  bool keeps_group(std::size_t group) const noexcept { return kept_.empty() || kept_[group]; }
  /// The n lanes of a batch with their owners and far ends (-1: of the owner as a whole), after an evaluation with Work::sample.
  /// selective: of the selective map, whose stresses come with their weight.
  void add(int n, const BatchScratch& s, bool selective);
  void add(const Entry& entry);
  /// After the loops: in ascending order, each owner and far end once, whatever thread they came from.
  void merge();
  /// Until the next `clear`: by group of eight points, as bits, the points whose bonds are wanted; empty: all of them.
  void want(std::span<const std::uint8_t> points) noexcept { wanted_ = points; }
  bool wants(std::size_t p) const noexcept { return wanted_.empty() || marked(wanted_.data(), p); }
  /// Until the next `clear`: what is said of a directed bond is said of the bond, both ways.
  void take_both_ways() noexcept { both_ways_ = true; }
  bool both_ways() const noexcept { return both_ways_; }
  /// Nothing belongs to points as a whole.
  bool of_bonds_alone() const noexcept { return !any_whole_; }
  const Entry* find(std::int32_t owner, std::int32_t far) const noexcept;
  std::span<const Entry> entries() const noexcept { return all_; }
  std::size_t bytes() const noexcept { return all_.capacity() * sizeof(Entry); }

 private:
  bool keeps(std::int32_t owner, std::int32_t far) const noexcept {
    return far < 0 || kept_.empty() || marked(kept_.data(), static_cast<std::size_t>(owner)) || marked(kept_.data(), static_cast<std::size_t>(far));
  }

  Space space_;
  BondSampling what_;
  std::span<const std::uint8_t> kept_, wanted_;
  std::vector<std::vector<Entry>> of_thread_;
  std::vector<Entry> all_;
  bool any_whole_ = false, both_ways_ = false;
  std::int32_t lowest_ = 0;          ///< owner
  std::vector<std::size_t> first_;   ///< by owner less the lowest: its first entry, and the end of the last one's
};

}  // namespace perikit
