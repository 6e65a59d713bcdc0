#pragma once
/// Loops over the bonds of a pair law: one for lattices, one for clouds. What happens to a bond is stated once, in the inline
/// functions below.

#include <atomic>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "families/blocks.hpp"
#include "families/cloud/nearest_failure.hpp"
#include "families/families.hpp"
#include "families/resting_blocks.hpp"
#include "families/stretch.hpp"
#include "model/formulation.hpp"
#include "operators/bond_screen.hpp"
#include "operators/group_energy.hpp"
#include "perikit/core/point_motion.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/operators/laws.hpp"
#include "terms/pairs/bond_factors.hpp"

namespace perikit {

/// dilatation, its rate along w, force -dE/du, tangent action d2E/du2 w, energy by point (half of each bond to each end).
enum class PairWork { dilatation, dilatation_rate, force, tangent, energy };

/// One loop over all bonds: the fields that go in and come out.
struct PairPass {
  PairWork work;
  ConstFieldView u, w;
  ConstFieldView q, dq;           ///< phi' d/m and its rate by point; empty without dilatation
  FieldView out;
  GroupEnergy* energies = nullptr;     ///< += by group of eight points
  /// By group of eight points: others are left alone (dilatation); where `local`, the bonds alone that these own, each
  /// once: as in a whole loop on points whose families lie in `only`, anything elsewhere (dilatation and force).
  const std::uint8_t* only = nullptr;
  bool local = false;
  const double* by_theta = nullptr;  ///< phi/theta d/m by point, where bonds are screened and there is a dilatation
  BondScreen* screen = nullptr;      ///< forces: where to mark groups; null: nowhere
  Arrival* arrival = nullptr;        ///< of u at the points of other ranks; null: it is there
  PointMotion* motion = nullptr;     ///< of u; null: it is there
};

/// Point quantities that bonds need.
struct PairFields {
  Field modulus;                  ///< c_i; empty where `uniform` holds
  double uniform = 0;
  const BondFactors* factors = nullptr;   ///< of the bonds; never null in a loop
  // Near interfaces between materials; else empty.
  std::vector<std::uint8_t> near; ///< by group of eight points
  Field sides;                    ///< see Side

  /// What a bond that crosses an interface needs of its ends: the number of the material, the distance from the interface [m], c_i (of an
  /// image that of its source), what c_i would be in a family of weighted volume 1, and whether the point stores something, 1 or 0.
  enum Side { material, distance, stiffness, of_material, stores, side_components };
  bool crosses(std::size_t p) const noexcept { return !near.empty() && near[p / padding]; }
  /// c_ij of a bond without its factor: the mean of both ends; across an interface springs in series, each as long as the bond lies on
  /// its side.
  double of_bond(std::size_t p, std::size_t q) const noexcept {
    if (modulus.size() == 0) return uniform;
    const Springs springs = across(p, q, stiffness);
    if (!springs.in_series) return 0.5 * (modulus.data()[p] + modulus.data()[q]);
    return 0.5 * (sides.component(stores)[p] + sides.component(stores)[q]) * (springs.length[0] + springs.length[1]) /
           (springs.length[0] / springs.c[0] + springs.length[1] / springs.c[1]);
  }
  /// Strain of the side of p over that of the whole bond, of springs in series; 1 where it does not cross. The dilatation of p sees its own side.
  /// By the materials alone: a ghost may not have its whole family.
  double own_strain(std::size_t p, std::size_t q) const noexcept {
    const Springs springs = across(p, q, of_material);
    if (!springs.in_series) return 1;
    return (springs.length[0] + springs.length[1]) / (springs.length[0] + springs.length[1] * springs.c[0] / springs.c[1]);
  }

 private:
  struct Springs {
    bool in_series = false;  ///< the bond crosses an interface, and both sides are stiff
    double c[2] = {}, length[2] = {};
  };
  Springs across(std::size_t p, std::size_t q, Side c) const noexcept {
    Springs springs;
    if (!crosses(p) || sides.component(material)[p] == sides.component(material)[q]) return springs;
    for (int end = 0; end < 2; ++end) {
      springs.c[end] = sides.component(c)[end == 0 ? p : q];
      springs.length[end] = sides.component(distance)[end == 0 ? p : q];
    }
    if (springs.length[0] + springs.length[1] == 0) springs.length[0] = springs.length[1] = 1;
    springs.in_series = springs.c[0] > 0 && springs.c[1] > 0;
    return springs;
  }
};

struct PairLoopParts {
  const Families& families;
  const Formulation& formulation;
  const PairFields& fields;
  bool half;                      ///< each bond once, for both ends
  bool quiet;                     ///< without the parts that no wave has reached
};

class PairLoop {
 public:
  explicit PairLoop(const PairLoopParts& parts) noexcept : half_(parts.half) {}
  virtual ~PairLoop() = default;
  /// Bonds may fail from now on: forces leave behind how far the bonds of each point are from failing. Null: they do not.
  virtual const NearestFailure* watch(double /*least_onset*/) { return nullptr; }
  virtual std::size_t blocks() const noexcept = 0;
  /// Forces and tangent actions are added to `out`, the others overwrite it. Returns the internal index of a point with a bond of
  /// zero or non-finite length, or -1. Moves the points of pass.motion, all of them.
  virtual std::int64_t run(const PairPass& pass) = 0;
  virtual std::size_t bytes() const noexcept = 0;
  RestingCounts resting_counts() const noexcept { return quiet_.counts(); }

 protected:
  /// Skips what no wave has reached from now on.
  void watch_waves(const BlockReach& reach) { quiet_ = RestingBlocks(reach); }
  static bool adds(PairWork work) noexcept { return work == PairWork::force || work == PairWork::tangent; }
  /// At the beginning of `run`. Dilatations, and forces without them, reach one family; forces from dilatations two. arrival: of what blocks
  /// read; null: it is there.
  template <class Moves>
  void look(const PairPass& pass, const Moves& moves, Arrival* arrival) {
    reach_ = pass.q.data ? 2 : 1;
    if (!pass.only && (pass.work == PairWork::force || pass.work == PairWork::dilatation))
      quiet_.look(reach_, moves, arrival, pass.motion);
    else
      quiet_.wake();
  }
  /// Each bond once, for both ends.
  bool at_once(const PairPass& pass) const noexcept { return half_ && pass.work != PairWork::energy && (!pass.only || pass.local); }
  /// block(work, b) for each block that is awake, `work` being pass.work as a constant; coloured where far ends are written.
  template <class Block>
  void each_block(const PairPass& pass, const Colouring& colouring, Arrival* arrival, const Block& block) const {
    const auto sweep = [&]<PairWork work>(std::integral_constant<PairWork, work> constant) {
      auto body = [&](std::size_t b) {
        if (quiet_.awake(b, reach_)) block(constant, b);
      };
      if (at_once(pass)) return colouring.for_each(body, arrival);
      if (arrival) arrival->finish();
      parallel_for(blocks(), body);
    };
    switch (pass.work) {
      case PairWork::dilatation: return sweep(std::integral_constant<PairWork, PairWork::dilatation>());
      case PairWork::dilatation_rate: return sweep(std::integral_constant<PairWork, PairWork::dilatation_rate>());
      case PairWork::force: return sweep(std::integral_constant<PairWork, PairWork::force>());
      case PairWork::tangent: return sweep(std::integral_constant<PairWork, PairWork::tangent>());
      case PairWork::energy: return sweep(std::integral_constant<PairWork, PairWork::energy>());
    }
  }
  void reset_bad() noexcept { bad_ = -1; }
  std::int64_t bad() const noexcept { return bad_; }
  /// Keeps the smallest index; from any thread.
  void report_bad(std::int64_t point) noexcept {
    std::int64_t known = bad_;
    while ((known < 0 || point < known) && !bad_.compare_exchange_weak(known, point)) {}
  }

 private:
  bool half_;
  std::atomic<std::int64_t> bad_{-1};
  RestingBlocks quiet_;
  int reach_ = 1;
};

template <int D>
std::unique_ptr<PairLoop> make_lattice_pairs(const PairLoopParts& parts);
template <int D>
std::unique_ptr<PairLoop> make_cloud_pairs(const PairLoopParts& parts);

/// Scratch of one thread; arrays over the bonds of a batch.
struct PairScratch {
  alignas(64) double e[batch_points];
  alignas(64) double de[batch_points];
  alignas(64) double y[3][batch_points];          ///< deformed bond
  alignas(64) double inverse_length[batch_points];///< of it
  alignas(64) double modulus[batch_points];
  alignas(64) double energy[batch_points];
  alignas(64) double force[batch_points];
  alignas(64) double stiffness[batch_points];
};

}  // namespace perikit
