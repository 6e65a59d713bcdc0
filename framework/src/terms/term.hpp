#pragma once
/// One thing that adds to the forces, the energy and the tangent of a body. Three functions are all that a term must have; what else it can do it says by
/// the capabilities that it returns.

#include <memory>
#include <span>
#include <string_view>

#include "assembly/assembly.hpp"
#include "assembly/volumetric_rows.hpp"
#include "families/families.hpp"
#include "operators/bond_samples.hpp"
#include "operators/bond_screen.hpp"
#include "operators/group_energy.hpp"
#include "operators/material_points.hpp"
#include "operators/point_flux.hpp"
#include "operators/report.hpp"
#include "operators/samples.hpp"
#include "perikit/model/configuration.hpp"

namespace perikit {

struct NearestFailure;

/// The evaluation points that an evaluation takes; by default all. They are those of the points `evaluated`, and the same few others whichever bonds have failed.
/// `gradients`: those points and everything in their families. Forces are complete, and bit for bit those of the whole body, at points all of whose
/// evaluation points lie in `evaluated`: those with a whole neighbourhood of max(coupling reach - 1, 1) families there. Elsewhere they are partial
/// sums, which callers ignore.
struct Region {
  const GroupMarks* evaluated = nullptr;
  const GroupMarks* gradients = nullptr;
  bool whole() const noexcept { return evaluated == nullptr; }
  /// Null: all.
  const std::uint8_t* only() const noexcept { return evaluated ? evaluated->data() : nullptr; }
  const std::uint8_t* near() const noexcept { return gradients ? gradients->data() : nullptr; }
};

/// A region of these points, with the marks that it refers to.
struct MarkedRegion {
  MarkedRegion() = default;
  MarkedRegion(const Families& families, GroupMarks of) : evaluated(std::move(of)), gradients(families.around(evaluated)) {}
  operator Region() const noexcept { return {&evaluated, &gradients}; }
  GroupMarks evaluated, gradients;
};

/// What an evaluation of forces adds to.
struct ForceSum {
  FieldView force;                       ///< += -dE/du [N]
  std::span<GroupEnergy> energies = {};  ///< += by group of eight points [J]; empty: not wanted
  bool stored = true;                    ///< stored energies are wanted, not only dissipated ones
  BondScreen* screen = nullptr;          ///< of the whole body alone: the bonds that may hold too much energy are marked in it; null: in none
  bool wants_stored() const noexcept { return stored && !energies.empty(); }
};

class AssembledTerm;
class SampledTerm;
class BreakableTerm;
class StatefulTerm;
class DrivenTerm;

class Term {
 public:
  virtual ~Term() = default;
  /// Adds the forces and energies of the region. Returns the internal index of the first inadmissible point, or -1; sums are undefined then.
  virtual std::int64_t forces(const Configuration& at, const Region& region, const ForceSum& sum) = 0;
  /// Kw += -d(force)/du w [N]; returns as `forces` does.
  virtual std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) = 0;
  /// Adds bytes, counts and notes of what is left out.
  virtual void report(ModelReport& report) const = 0;

  /// What an inadmissible point is, in words.
  virtual std::string_view inadmissible() const noexcept { return "det F <= 0 or not finite"; }
  /// Whether the tangent is the same at all displacements and times, as long as no bond fails.
  virtual bool constant_tangent() const noexcept { return false; }

  /// Null: the tangent couples no two points, and its blocks are taken from `tangent`.
  virtual AssembledTerm* assembled() noexcept { return nullptr; }
  /// Null: energies by point are unknown, and samples lack them.
  virtual SampledTerm* sampled() noexcept { return nullptr; }
  /// Null: it knows nothing of bonds.
  virtual BreakableTerm* breakable() noexcept { return nullptr; }
  /// Null: it remembers nothing.
  virtual StatefulTerm* stateful() noexcept { return nullptr; }
  /// Null: its forces are minus the derivative of its energy, at all times of the same.
  virtual DrivenTerm* driven() noexcept { return nullptr; }
};

/// A term whose tangent couples points.
class AssembledTerm {
 public:
  virtual ~AssembledTerm() = default;
  /// The tangent couples two points only where a chain of at most so many bonds joins them.
  virtual int coupling_reach() const noexcept = 0;
  /// The rows outlive the assembly.
  virtual std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) = 0;
  /// What of the tangent resists changes of the volumes of points; null where volumes are not those of points. The term must outlive it.
  virtual std::unique_ptr<VolumetricRows> make_volumetric_rows() { return nullptr; }
};

/// A term that knows what its points hold.
class SampledTerm {
 public:
  virtual ~SampledTerm() = default;
  /// Adds to the energy density, and sets what else it knows. Returns as Term::forces does.
  virtual std::int64_t sample(const Configuration& at, PointSamples& samples) = 0;
  /// Forces of the whole body and samples, each with the bits that it has alone.
  virtual std::int64_t forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) = 0;
};

/// A term over bonds that may fail.
class BreakableTerm {
 public:
  virtual ~BreakableTerm() = default;
  /// What follows from the bonds of these points is to be computed anew.
  virtual void bonds_changed(std::span<const std::int32_t> points) = 0;
  /// Marks the points whose energies are summed up together with those of marked ones.
  virtual void complete(GroupMarks& marks) const { mark_whole_runs(1, marks); }
  /// What the evaluation points of the region hold.
  virtual void add_bonds(const Configuration& at, const Region& region, BondSamples& samples) = 0;
  /// Bonds may fail by their stretch from now on, none below this one. What its loop over forces leaves behind for those who look for them; null: nothing.
  virtual const NearestFailure* watch(double /*least_onset*/) { return nullptr; }
  /// Of the last evaluation, where that was one of forces, and leaves any.
  virtual PointFlux point_flux() const noexcept { return {}; }
};

/// A term whose evaluation points remember what has happened to them.
class StatefulTerm {
 public:
  virtual ~StatefulTerm() = default;
  virtual MaterialPoints& points() noexcept = 0;
  /// Its values were replaced.
  virtual void history_restored() = 0;
  /// Its evaluation points here, ascending. Failed bonds have none.
  virtual std::vector<HistoryPlace> history_points() = 0;
  /// to[k * components + c] <- component c of the variable of this name at points[k], averaged over the evaluation points that belong to the point by their weights; 0 where
  /// the law of the point has none, or no bond is left. Laws that have it give it so many components.
  virtual void average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) = 0;
  /// Of the last evaluation of forces, if it ended a step: the share of its length that a law asks for, and an internal index of a point of that law; 1, -1: none does.
  struct ShorterStep {
    double factor = 1;
    std::int64_t point = -1;
  };
  virtual ShorterStep shorter_step() = 0;
  /// Energies that are dissipated in a step come with its forces.
  virtual bool dissipates() const noexcept = 0;
};

/// Where the work goes that forces do and no energy holds.
enum class Drive : int { outside, loss };

/// A term whose forces do other work than its energy falls by: it depends on the time, or its forces are no derivative.
class DrivenTerm {
 public:
  virtual ~DrivenTerm() = default;
  /// Whether something of it is driven so, here or on another rank.
  virtual bool driven(Drive drive) const noexcept = 0;
  /// Forces and energies of what is driven so, alone. Returns as Term::forces does.
  virtual std::int64_t driven_forces(const Configuration& at, Drive drive, const ForceSum& sum) = 0;
  virtual bool conservative() const noexcept = 0;
  virtual bool needs_velocity() const noexcept = 0;
};

}  // namespace perikit
