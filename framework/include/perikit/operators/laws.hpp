#pragma once
/// The materials of a body: which law and which constants belong to which point, and batched evaluation across laws.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/core/space.hpp"
#include "perikit/model/material.hpp"

namespace perikit {

/// Evaluation points are handed to materials in batches of at most this many (a multiple of `padding`), so that a batch stays in
/// the first-level cache while the virtual call is amortised.
inline constexpr int batch_points = 128;

struct MaterialRecord {
  std::shared_ptr<const Material> material;
  MaterialTraits traits;
  AlignedVector<double> constants;       ///< traits.constants values; or, where they vary in space, that many times stride
  bool uniform = true;
  double density = 0;                    ///< [kg/m^3]; 0: not given. Where it varies, see `densities`
  AlignedVector<double> densities;       ///< by point; empty where uniform
  bool silent = false;                   ///< stores nothing: of ghosts and images. At most two, the last
  bool incomplete = false;               ///< of points whose families are incomplete on this rank: their bonds store nothing either
};

/// Memory for the pieces of mixed batches; one per thread.
struct LawScratch {
  alignas(64) double H[9 * batch_points];
  alignas(64) double psi[batch_points];
  alignas(64) double lateral[batch_points];
  alignas(64) double dissipated[batch_points];
  alignas(64) double step_factor[batch_points];
  alignas(64) double P[9 * batch_points];
  alignas(64) double dP[9 * batch_points];
  AlignedVector<double> constants;
  AlignedVector<double> external;        ///< of laws that read any
  AlignedVector<double> A;               ///< only where tangents are asked for
  AlignedVector<double> history;         ///< of laws that have one, at the end of the step,
  AlignedVector<double> begin;           ///< and at its beginning
};

/// What laws remember, of the lanes of a batch: component c of lane l is [c * stride + l]. Batches that may mix laws have stride batch_points.
struct LawState {
  const double* begin = nullptr;         ///< at the beginning of the step; null: fresh
  double* end = nullptr;                 ///< where to put it if the step ends here; null: not wanted
  std::size_t stride = 0;
  double time_step = 0;                  ///< [s]
};

/// What is given to laws from outside, and between which points the lanes of a batch lie. far: -1 where a lane belongs to its owner alone; null: all do. Both are read where a value is a field.
struct LawSurroundings {
  std::span<const ExternalValue> values;
  const std::int32_t* owner = nullptr;
  const std::int32_t* far = nullptr;
};

struct LawBatch {
  int n = 0;                             ///< <= batch_points; arrays have stride batch_points
  const double* H = nullptr;
  const double* dH = nullptr;
  bool confined = false;                 ///< see MaterialBatch
  const std::int32_t* points = nullptr;  ///< owner of each lane (any live index in the padding); null where single()
  double* psi = nullptr;
  double* P = nullptr;
  double* dP = nullptr;
  double* A = nullptr;                   ///< A[(r * components + c) * batch_points + l] = dP_r / dF_c [Pa]
  LawState state;                        ///< of laws with history
  LawSurroundings external{};            ///< of laws that read variables from outside
  double* lateral = nullptr;             ///< H33 that plane and line stress found; see MaterialBatch
  double* dissipated = nullptr;          ///< in the step; see MaterialBatch
  double* step_factor = nullptr;         ///< likewise; 1 of laws that take any step
};

class Laws {
 public:
  Laws(Space space, std::vector<MaterialRecord> records, std::span<const std::uint16_t> ids, std::size_t stride);

  Space space() const noexcept { return space_; }
  int components() const noexcept { return tensor_components(space_); }
  /// One law with the same constants everywhere.
  bool single() const noexcept { return single_; }
  bool constant_tangent() const noexcept;
  bool objective() const noexcept;
  bool symmetric_tangent() const noexcept;
  /// Doubles of history per evaluation point, the most of any law; 0 where every law depends on F alone.
  int state_components() const noexcept { return state_; }
  /// Some law says what its steps dissipate.
  bool dissipates() const noexcept { return dissipates_; }
  /// Some law reads variables from outside.
  bool read_external() const noexcept { return read_external_; }
  /// Some steps may be too long for some law.
  bool limit_steps() const noexcept { return limit_steps_; }
  /// Both points have the same law and the same constants, so that a symmetric bond needs one evaluation.
  bool same(std::size_t p, std::size_t q) const noexcept {
    return ids_.empty() ? records_[0].uniform : ids_[p] == ids_[q] && records_[ids_[p]].uniform;
  }
  /// True if this rank stores points whose families are incomplete, and if this one is: their bonds store no energy here.
  bool has_incomplete_points() const noexcept { return records_.back().incomplete; }
  bool incomplete(std::size_t p) const noexcept { return ids_[p] + std::size_t{1} == records_.size(); }
  std::size_t id_of(std::size_t p) const noexcept { return ids_.empty() ? 0 : ids_[p]; }
  const MaterialRecord& record_of(std::size_t p) const noexcept { return records_[id_of(p)]; }
  const std::vector<MaterialRecord>& records() const noexcept { return records_; }
  Moduli moduli(std::size_t p) const;
  double density(std::size_t p) const noexcept;

  /// Memory for evaluations; `tangents`: with LawBatch::A.
  void prepare(LawScratch& scratch, bool tangents) const;
  Status evaluate(const LawBatch& batch, LawScratch& scratch) const noexcept;
  /// One law on all lanes, whatever the materials of `points`, which say where constants that vary are taken.
  Status evaluate_law(std::size_t id, const LawBatch& batch, LawScratch& scratch) const noexcept {
    return evaluate_one(records_[id], batch, scratch);
  }
  /// What a law with the same constants everywhere and without history knows of F that grows alike in all directions.
  enum class Growth {
    unknown,
    decoupled,     ///< Material::isochoric_constants
    green_linear,  ///< MaterialTraits::green_linear
  };
  Growth growth(std::size_t id) const noexcept { return growth_[id].known; }
  /// Of a law that is green_linear [Pa].
  double bulk_modulus(std::size_t id) const noexcept { return growth_[id].kappa; }
  /// The isochoric part of a decoupled law on all lanes.
  Status evaluate_isochoric(std::size_t id, const LawBatch& batch, LawScratch& scratch) const noexcept {
    return evaluate_one(growth_[id].isochoric, batch, scratch);
  }
  /// Its volumetric part; constants are filled in.
  void evaluate_volumetric(std::size_t id, VolumeBatch batch) const noexcept;

 private:
  /// One law on all lanes, whose results at points that store nothing are made zero.
  Status evaluate_among_silent(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch) const noexcept;
  Status evaluate_one(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch) const noexcept;
  static void find_external(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch, MaterialBatch& call) noexcept;

  struct GrowthOfLaw {
    Growth known = Growth::unknown;
    double kappa = 0;
    MaterialRecord isochoric;
  };
  static GrowthOfLaw growth_of(const MaterialRecord& record, Space space);

  Space space_;
  std::vector<MaterialRecord> records_;
  std::vector<GrowthOfLaw> growth_;
  std::span<const std::uint16_t> ids_;
  std::size_t stride_;
  bool single_;
  std::size_t silent_;                   ///< the first record that stores nothing
  int state_ = 0;                        ///< components of history, the most of any law
  bool dissipates_ = false, limit_steps_ = false, read_external_ = false;
};

}  // namespace perikit
