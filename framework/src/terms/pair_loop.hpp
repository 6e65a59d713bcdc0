#pragma once
/// Loops over the bonds of a pair law: one for lattices, one for clouds. What happens to a bond is stated once, in the inline
/// functions below.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "families/bond_state.hpp"
#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/operators/laws.hpp"
#include "perikit/model/kinematics.hpp"
#include "families/quiet_blocks.hpp"

namespace perikit {

/// dilatation, its rate along w, force -dE/du, tangent action d2E/du2 w, energy by point (half of each bond to each end).
enum class PairWork { dilatation, dilatation_rate, force, tangent, energy };

/// One loop over all bonds: the fields that go in and come out.
struct PairPass {
  PairWork work;
  ConstFieldView u, w;
  ConstFieldView q, dq;           ///< phi' d/m and its rate by point; empty without dilatation
  FieldView out;
  double* energies = nullptr;     ///< by block
  const std::uint8_t* only = nullptr;   ///< by group of eight points: others are left alone (dilatation and energy)
};

/// Point quantities that bonds need.
struct PairFields {
  Field modulus;                  ///< c_i; empty where `uniform` holds
  double uniform = 0;
  Field correction;               ///< by axis; empty without surface correction
};

/// A bond of a family as the set-up sees it.
struct FamilyBond {
  double xi[3];                   ///< input axes [m]
  double length, omega, volume;
  double integrity;
};

struct PairCounts {
  std::size_t bonds = 0, broken = 0, bytes = 0, recomputed = 0;   ///< recomputed: bytes that are not stored
};

class PairLoop {
 public:
  using Visit = std::function<void(const std::vector<FamilyBond>&, const std::vector<std::int32_t>& points)>;
  virtual ~PairLoop() = default;
  /// Every family once, with all points that have it.
  virtual void families(const Visit& visit) const = 0;
  /// The families of these points, one by one.
  virtual void families_of(std::span<const std::int32_t> points, const Visit& visit) const = 0;
  /// Made on the first call: bodies without damage have no state.
  virtual BondState& bond_state() = 0;
  virtual std::size_t blocks() const noexcept = 0;
  /// `out` is fully overwritten. Returns the internal index of a point with a bond of zero or non-finite length, or -1.
  virtual std::int64_t run(const PairPass& pass) = 0;
  virtual PairCounts counts() const noexcept = 0;
  QuietCounts quiet_counts() const noexcept { return quiet_.counts(); }

 protected:
  /// Skips what no wave has reached from now on.
  void watch(const BlockReach& reach) { quiet_ = QuietBlocks(reach); }
  /// At the beginning of `run`. Dilatations, and forces without them, reach one family; forces from dilatations two.
  template <class Moves>
  void look(const PairPass& pass, const Moves& moves) {
    reach_ = pass.q.data ? 2 : 1;
    if (!pass.only && (pass.work == PairWork::force || pass.work == PairWork::dilatation)) quiet_.look(reach_, moves);
    else quiet_.wake();
  }
  bool awake(std::size_t b) const noexcept { return quiet_.awake(b, reach_); }
  void reset_bad() noexcept { bad_ = -1; }
  std::int64_t bad() const noexcept { return bad_; }
  /// Keeps the smallest index; from any thread.
  void report_bad(std::int64_t point) noexcept {
    std::int64_t known = bad_;
    while ((known < 0 || point < known) && !bad_.compare_exchange_weak(known, point)) {}
  }

 private:
  std::atomic<std::int64_t> bad_{-1};
  QuietBlocks quiet_;
  int reach_ = 1;
};

struct PairLoopParts {
  const Body& body;
  const InfluenceFunction& influence;
  const PairKinematics& law;
  const PairFields& fields;
  bool half;                      ///< each bond once, for both ends
  bool quiet;                     ///< without the parts that no wave has reached
};

template <int D>
std::unique_ptr<PairLoop> make_lattice_pairs(const PairLoopParts& parts);
template <int D>
std::unique_ptr<PairLoop> make_cloud_pairs(const PairLoopParts& parts);

/// Scratch of one thread; arrays over the bonds of a batch.
struct PairScratch {
  alignas(64) double e[batch_points];
  alignas(64) double de[batch_points];
  alignas(64) double n[3][batch_points];          ///< deformed direction
  alignas(64) double inverse_length[batch_points];///< of the deformed bond
  alignas(64) double modulus[batch_points];
  alignas(64) double energy[batch_points];
  alignas(64) double force[batch_points];
  alignas(64) double stiffness[batch_points];
};

/// Extension and direction of a deformed bond. e = (|y|^2 - |xi|^2)/(|y| + |xi|) keeps its digits for small strains and is
/// exactly zero for du = 0.
template <int D>
struct Stretch {
  Pack e, inverse_length, n[D];

  Stretch(const Pack (&xi)[D], Pack length, const Pack (&du)[D]) noexcept {
    Pack difference(0.0), y[D];
    for (int c = 0; c < D; ++c) {
      y[c] = xi[c] + du[c];
      difference += du[c] * (xi[c] + y[c]);
    }
    const Pack square = length * length + difference;
    inverse_length = reciprocal_sqrt(square);
    e = difference * reciprocal(square * inverse_length + length);
    for (int c = 0; c < D; ++c) n[c] = y[c] * inverse_length;
  }
  Pack along(const Pack (&dw)[D]) const noexcept {
    Pack sum(0.0);
    for (int c = 0; c < D; ++c) sum += n[c] * dw[c];
    return sum;
  }
};

}  // namespace perikit
