#pragma once
/// What is done to evaluation points, once for all spaces and both maps. A batch of them on its way through the law:
/// H -> W P (forces), H, dH -> -W A : dH (tangent), or sums of point averages (sample), with the history of laws that have one.

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "core/group_marks.hpp"
#include "maps/selective_map.hpp"
#include "operators/bond_screen.hpp"
#include "operators/group_energy.hpp"
#include "operators/laminates.hpp"
#include "operators/material_points.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/point_motion.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

enum class Work { force, tangent, sample };

/// In place of the laws, for weights that balance a constant stress (spaces/consistency.hpp): the stress of an evaluation point
/// is (constant + tr H + multiplier of its owner) times the unit tensor.
struct Balance {
  double constant = 0;
  const double* multiplier = nullptr;     ///< by point
  const std::uint8_t* counted = nullptr;  ///< by point: evaluation points of others have no weight
  double* sums = nullptr;                 ///< by point: += W times that factor, over the evaluation points of the owner
  /// Factors by number of the evaluation point (EvaluationSpace::factors) are written here, 0 where it has no weight; nothing is
  /// scattered.
  double* factors = nullptr;
};

/// Scratch of one thread. Arrays are [component][lane] with stride batch_points.
struct BatchScratch {
  alignas(64) double H[9 * batch_points];
  alignas(64) double dH[9 * batch_points];
  alignas(64) double P[9 * batch_points];        ///< result: stress, of which every lane counts stress_weight
  const double* stress_weight = nullptr;         ///< result: -W for a tangent, else W; null: P is weighted already
  alignas(64) double other[9 * batch_points];    ///< stress of the far ends' material
  alignas(64) double psi[batch_points];
  alignas(64) double highest[batch_points];  ///< of psi over the laws of both ends, where bonds are screened (result)
  alignas(64) double lateral[batch_points];
  alignas(64) double dissipated[batch_points];
  alignas(64) double step_factor[batch_points];
  // Selective map: gradients before it, and where the volume changes of the owners are, by end (to be filled in by the engine),
  // `volume` a place to gather them; weighted pressures on the owners by end (result).
  alignas(64) double Ht[9 * batch_points];
  alignas(64) double dHt[9 * batch_points];
  alignas(64) double volume[volume_components * batch_points];
  OwnerVolumes owner_volumes;
  std::int64_t volume_group[batch_points / padding];
  alignas(64) double pressure[batch_points];
  alignas(64) double pressure_rate[batch_points];
  alignas(64) double inverse[batch_points];
  alignas(64) double growth[batch_points];
  // Of laws that are evaluated once for both ends: the weights of both together, and of those that are decoupled volume changes by end and what the
  // laws make of them.
  alignas(64) double bond_weight[batch_points];
  alignas(64) double volume_change[batch_points];
  alignas(64) double volumetric_psi[batch_points];
  alignas(64) double kirchhoff[batch_points];
  alignas(64) double kirchhoff_slope[batch_points];
  alignas(64) double weight[batch_points];       ///< of the owner's material [m^3]
  alignas(64) double far_weight[batch_points];   ///< of the far end's material, where both ends are evaluated at once
  alignas(64) double own_weight[batch_points];   ///< as `weight` came in, where samples are taken along
  alignas(64) double bond[3][3 * batch_points];  ///< xi, g and auxiliaries per lane
  std::int32_t owner[batch_points];
  std::int32_t far[batch_points];
  /// The law of both ends of all lanes, with the same constants, where the space knows it, and none is a laminate; else -1: owner and
  /// far tell.
  std::int32_t one_law = -1;
  LawScratch law;
  std::unique_ptr<LaminateScratch> laminate;     ///< where there are interfaces between materials
  // Laws with history: the stable numbers of the lanes, to be filled in by the space where history is kept.
  std::int64_t first_number = -1;                ///< of lane 0 where those of all lanes, padding included, follow each other; else -1, and
  std::int64_t number[batch_points];             ///< by lane; -1: fresh, and not kept
  std::int64_t far_number = 0;                   ///< added where a bond is evaluated for its far end
  bool keep_history = true;                      ///< false: another block keeps that of these lanes
  AlignedVector<double> old_state, new_state;    ///< gathered, [component][lane]
};

/// Sums over lanes of sampled quantities go here, one row per owner; null, but for psi: not asked for.
struct SampleSums {
  double* weight;      ///< sum W
  double* psi;         ///< sum W psi
  double* H;           ///< tensor components x stride
  double* P;
  double* cauchy;      ///< 9 x stride
  double* von_mises;
  std::size_t stride;
};

/// One BatchScratch per thread.
class ScratchPool {
 public:
  /// Before a parallel loop: memory for every thread, with room for the constants of the laws.
  void prepare(const Laws& laws, bool laminates = false);
  BatchScratch& mine() noexcept { return *scratch_[static_cast<std::size_t>(thread_index())]; }
  std::size_t bytes() const noexcept { return scratch_.size() * sizeof(BatchScratch); }

 private:
  std::vector<std::unique_ptr<BatchScratch>> scratch_;
};

class BondSamples;

/// What is asked of the evaluation points, and what takes part. Null: nothing of that kind.
struct BatchTask {
  Work work = Work::force;
  bool energy = false;                   ///< stored energies are wanted
  bool selective = false;                ///< gradients go through the selective map
  MaterialPoints* points = nullptr;      ///< of laws that remember
  double time_step = 0;                  ///< of the step that laws take [s]
  std::span<const ExternalValue> external = {};   ///< given to laws
  bool ends_step = false;                ///< what they remember at its end is kept, and what they dissipate counts
  const Balance* balance = nullptr;      ///< in place of laws
  BondScreen* screen = nullptr;          ///< where bonds that may hold too much are marked
  const Laminates* laminates = nullptr;
};

class BatchWork {
 public:
  BatchWork(const Laws& laws, const BatchTask& task)
      : laws_(laws),
        work_(task.work),
        energy_(task.energy),
        selective_(task.selective),
        points_(task.points && task.points->remember() ? task.points : nullptr),
        time_step_(task.time_step),
        external_(laws.read_external() ? task.external : std::span<const ExternalValue>()),
        ends_step_(task.ends_step),
        balance_(task.balance),
        screen_(task.screen),
        laminates_(task.laminates) {}

  /// With Work::sample: stresses of the selective map become derivatives by the gradients that came in, W times; with pressures.
  void pull_back() noexcept { pulled_back_ = true; }

  /// With Work::force, of evaluation points that belong to both ends of bonds of one law, without selective map, history and laminates: adds the
  /// samples of the lanes here as well.
  void sample_along(const SampleSums& sums) noexcept { along_ = &sums; }

  Work work() const noexcept { return work_; }
  /// Samples are taken, alone or along with forces.
  bool samples() const noexcept { return work_ == Work::sample || along_; }
  bool selective() const noexcept { return selective_; }
  bool tangent() const noexcept { return work_ == Work::tangent; }
  /// The evaluation ends a step in which laws dissipate.
  bool dissipates() const noexcept { return work_ == Work::force && points_ && ends_step_ && laws_.dissipates(); }
  /// The evaluation ends a step that may be too long for a law.
  bool limits_step(const BatchScratch& s) const noexcept { return points_ && laws_.limit_steps() && keeps_history(s); }
  /// After evaluate, where bonds are screened: marks the group of eight points from first_point on if one of them may hold too
  /// much. Lanes first_lane ... first_lane + lanes - 1 belong to these points in turn.
  void screen(std::int64_t first_point, int first_lane, int lanes, const BatchScratch& s) const noexcept;
  /// The same where the first `lanes` lanes belong to `count` points in turn, every eighth to the same one. From any thread.
  void screen(const std::int32_t* points, int count, int lanes, const BatchScratch& s) const noexcept;
  /// Whether evaluation points that belong to bonds are screened by bond: their ends are to be in s.owner and s.far.
  bool screens_bonds() const noexcept { return screen_ && screen_->by_bond(); }
  /// Whether one of these lanes, which belong to a chunk of points in turn, may hold too much.
  bool may_hold_too_much(std::int64_t first_point, int lanes, const BatchScratch& s) const noexcept;
  /// After evaluate: names the bonds of n lanes that may hold too much. far_end: the lane of the far end's evaluation point of lane 0; -1: none. Of
  /// evaluation points with factors these; null: 1.
  void screen_bonds(int n, int far_end, const BatchScratch& s, const double* factor = nullptr, const double* far_factor = nullptr) const;
  /// Whether laws ask between which points the lanes lie: s.owner and s.far (-1: at the owner) are to be filled in.
  bool wants_ends() const noexcept { return !external_.empty(); }
  /// Whether the numbers of lanes are asked for.
  bool numbered() const noexcept { return points_ || laminates_; }
  /// Some evaluation points are laminates.
  bool laminates() const noexcept { return laminates_ != nullptr; }
  /// These eight points may own laminates.
  bool laminates_near(std::int32_t first) const noexcept { return laminates_ && laminates_->near(first); }
  /// What is done in place of laws; null: laws are.
  const Balance* balance() const noexcept { return balance_; }

  /// Evaluates n lanes with W = weight (owner's law) and, where `both_ends`, W = far_weight for the far end's law as well; with forces and tangents
  /// neither is kept.
  /// s.P times s.stress_weight <- sum of W P (force) or -W A:dH (tangent). Adds the energies of the lanes to *energy. Returns the first bad lane
  /// or -1.
  /// With the selective map gradients come in as s.Ht, s.dHt, with s.owner_volumes; s.pressure and s.pressure_rate are results too; both
  /// ends of at most batch_points / 2 lanes.
  int evaluate(int n, BatchScratch& s, bool both_ends, GroupEnergy* energy) const noexcept;
  /// After evaluate, for whoever does not weigh stresses where they are read.
  void weigh_stress(int n, BatchScratch& s) const noexcept;
  /// After evaluate with Work::sample: adds lane l to the sums of owner s.owner[l], and of both_ends with far_weight to those of s.far[l].
  void add_samples(int n, const BatchScratch& s, const SampleSums& sums, bool both_ends) const noexcept {
    add_samples(n, s, s.weight, sums, both_ends);
  }

 private:
  /// The lanes of a batch that are laminates.
  struct LaminateLanes {
    int n = 0;
    int lane[batch_points];
    const LaminatePoint* point[batch_points];
  };

  int pass(int n, BatchScratch& s, const std::int32_t* points, std::int64_t numbers, double* weight, double* P, GroupEnergy* energy,
           const LaminateLanes* laminates) const noexcept;
  void find_laminates(int n, const BatchScratch& s, bool both_ends, LaminateLanes& lanes) const noexcept;
  void merge_weights(BatchScratch& s, const LaminateLanes& lanes) const noexcept;
  void repeat_for_ends(int lanes, const BatchScratch& s, int ends, LaminateLanes& of) const noexcept;
  int evaluate_laminates(BatchScratch& s, double* P, double* dP, const LaminateLanes& lanes) const noexcept;
  bool one_law(const BatchScratch& s) const noexcept { return laws_.single() || s.one_law >= 0; }
  /// The gradients that the space gives have no lateral strain. Mapped ones have.
  bool confined() const noexcept { return laws_.space() == Space::plane_strain || laws_.space() == Space::line_strain; }
  int evaluate_plain(int n, BatchScratch& s, bool both_ends, GroupEnergy* energy, const LaminateLanes* laminates) const noexcept;
  void add_energies(int n, const double* weight, const BatchScratch& s, int first, GroupEnergy* energy) const noexcept;
  void add_samples(int n, const BatchScratch& s, const double* weight, const SampleSums& sums, bool both_ends) const noexcept;
  int balance_pass(int n, BatchScratch& s, bool both_ends) const noexcept;
  void leave_out_incomplete(int n, BatchScratch& s) const noexcept;
  int selective_pass(int n, BatchScratch& s, int ends, GroupEnergy* energy) const noexcept;
  int mapped_pass(int n, BatchScratch& s, int ends) const noexcept;
  int once_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept;
  int decoupled_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept;
  int green_linear_pass(int n, BatchScratch& s, int ends, std::size_t law, const double* counted) const noexcept;
  int mixed_pass(int n, BatchScratch& s, int ends) const noexcept;
  /// Which laws n bonds are evaluated by: one, or several.
  struct BondLaws {
    static constexpr std::int32_t each_end = -1, no_end = -2;
    std::int32_t of[batch_points];   ///< a law that is evaluated once; or each end by itself, or neither, as both store nothing
    bool one = true;             ///< both ends of all have the same one, which is evaluated once
    bool any_each_end = false;   ///< some are evaluated for each end by itself
    bool any_once = false;       ///< some once for both ends
  };
  void find_laws(int n, const BatchScratch& s, int ends, BondLaws& laws) const noexcept;
  LawBatch own_gradients(int n, BatchScratch& s) const noexcept;
  int evaluate_laws(int n, BatchScratch& s, const std::int32_t* points, std::int64_t numbers, double* P, double* dP) const noexcept;
  /// Of the lanes of a batch; their numbers plus `numbers`.
  LawState begin_state(int n, BatchScratch& s, std::int64_t numbers) const noexcept;
  void end_state(int n, BatchScratch& s, std::int64_t numbers) const noexcept;
  /// Of lanes first ... first + n - 1 that have a weight: tells the points which step their laws ask for.
  void ask_for_steps(int first, int n, const double* weight, const BatchScratch& s, std::int64_t numbers) const;
  bool keeps_history(const BatchScratch& s) const noexcept { return work_ == Work::force && ends_step_ && s.keep_history; }

  const Laws& laws_;
  Work work_;
  bool energy_;
  bool selective_, pulled_back_ = false;
  MaterialPoints* points_;               ///< null where nothing is remembered
  double time_step_;
  std::span<const ExternalValue> external_;
  bool ends_step_;
  const Balance* balance_;
  BondScreen* screen_;
  const Laminates* laminates_;
  const SampleSums* along_ = nullptr;
};

/// One evaluation of a whole model: the fields that go in and come out, and the first inadmissible point.
struct Pass {
  const BatchWork& work;
  ConstFieldView u, w;
  FieldView out;
  const SampleSums* sums = nullptr;
  /// By group of eight points: each has its own, or the first group of a block that of all of it (EvaluationSpace::complete).
  GroupEnergy* energies = nullptr;
  std::int64_t bad = -1;          ///< internal index
  std::mutex guard;
  /// GroupMarks: only the evaluation points that these points own are wanted; point gradients are needed at `near`. Forces are then those of a whole pass on
  /// points whose families' families lie in `only`, bit for bit; anything elsewhere.
  const std::uint8_t* only = nullptr;
  const std::uint8_t* near = nullptr;
  BondSamples* bonds = nullptr;  ///< with Work::sample: where evaluation points go instead of `sums`
  Arrival* arrival = nullptr;    ///< of u at the points of other ranks; null: it is there
  PointMotion* motion = nullptr; ///< of u, where the space moves points; null: it is there

  /// The lanes of a batch after an evaluation with Work::sample; their far ends in s.far, -1 where evaluation points belong to
  /// points. both_ends: sums of far ends, too.
  void add_samples(int n, const BatchScratch& s, bool both_ends = false);
  /// The pass reads stresses and energies, point by point, and adds nothing to forces.
  bool gathers_only() const noexcept { return work.work() == Work::sample || (work.balance() && work.balance()->factors); }
  /// Every block has something to do, whether its points move or not.
  bool everywhere() const noexcept { return only || gathers_only() || work.samples() || work.tangent() || work.balance(); }
  bool wanted(std::int64_t point) const noexcept { return !only || marked(only, static_cast<std::size_t>(point)); }
  bool gradient_wanted(std::int64_t point) const noexcept { return !near || marked(near, static_cast<std::size_t>(point)); }
  /// Of any of the eight points from here on.
  bool gradients_wanted(std::size_t first) const noexcept { return !near || near[first / padding]; }

  void report(std::int64_t point) {
    const std::lock_guard lock(guard);
    if (bad < 0 || point < bad) bad = point;
  }
};

}  // namespace perikit
