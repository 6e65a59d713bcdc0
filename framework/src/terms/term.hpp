#pragma once
/// One thing that adds to the forces, the energy and the tangent of a body. Evaluations return the internal index of the first
/// inadmissible point, or -1; results are undefined then.

#include <memory>
#include <span>

#include "assembly/assembly.hpp"
#include "families/families.hpp"
#include "families/resting_counts.hpp"
#include "operators/bond_samples.hpp"
#include "operators/point_flux.hpp"
#include "operators/report.hpp"
#include "operators/samples.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/point_motion.hpp"

namespace perikit {

class Term {
 public:
  virtual ~Term() = default;
  /// force += -dE/du [N]; *energy += E of what this rank owns [J] where wanted.
  virtual std::int64_t add_forces(ConstFieldView u, FieldView force, ExactSum* energy) = 0;
  /// The same while displacements of points of other ranks are on their way, which have arrived when it returns.
  virtual std::int64_t add_forces_meanwhile(Arrival& arrival, ConstFieldView u, FieldView force, ExactSum* energy) {
    arrival.finish();
    return add_forces(u, force, energy);
  }
  /// The same of displacements that `motion` makes, which also sets force to zero on the points that it moves. All have moved when this returns.
  virtual std::int64_t move_and_add_forces(PointMotion& motion, ConstFieldView u, FieldView force, ExactSum* energy) {
    motion.finish();
    return add_forces(u, force, energy);
  }
  /// Forces and samples of the same displacements, each with the bits that it has alone.
  virtual std::int64_t add_forces_and_samples(ConstFieldView u, FieldView force, ExactSum* energy, PointSamples& samples) {
    const std::int64_t bad = add_forces(u, force, energy);
    return bad < 0 ? add_samples(u, samples) : bad;
  }
  /// Kw += -d(force)/du w [N].
  virtual std::int64_t add_tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) = 0;
  /// Adds to the energy density, and sets what else it knows.
  virtual std::int64_t add_samples(ConstFieldView u, PointSamples& samples) = 0;

  /// The tangent couples two points only where a chain of at most so many bonds joins them.
  virtual int coupling_reach() const noexcept = 0;
  /// The rows outlive the assembly.
  virtual std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) const = 0;

  // Where bonds fail.
  /// Evaluates the evaluation points of the points `only`, and the same few others whichever bonds have failed. `near`: those points and everything in
  /// their families. Forces are complete, and bit for bit those of add_forces, at points all of whose evaluation points lie in `only`: those with a whole
  /// neighbourhood of max(coupling_reach() - 1, 1) families there. Elsewhere they are partial sums, which callers ignore.
  /// *energy += their E, of what this rank owns [J], where wanted.
  virtual std::int64_t add_forces_of(ConstFieldView u, const GroupMarks& only, const GroupMarks& near, FieldView force,
                                     ExactSum* energy) = 0;
  /// Marks the points whose energies are summed up together with those of marked ones.
  virtual void complete(GroupMarks& marks) const { mark_whole_runs(1, marks); }
  /// As add_forces_of. The energies of the points of `complete`, which lie in `only`, take the place of those that the last add_forces with an
  /// energy left, or the last of these calls; energy += E of all points, bit for bit as add_forces has it.
  virtual std::int64_t renew_forces(ConstFieldView u, const GroupMarks& only, const GroupMarks& complete, const GroupMarks& near, FieldView force,
                                    ExactSum& energy) = 0;
  /// Kw += -d(force)/du w of the evaluation points that add_forces_of takes, with the same promise.
  virtual std::int64_t add_tangent_of(ConstFieldView u, ConstFieldView w, const GroupMarks& only, const GroupMarks& near,
                                      FieldView Kw) = 0;
  /// What the evaluation points of the marked points hold; point gradients are needed at `near`.
  virtual void add_bonds(ConstFieldView u, const GroupMarks& marks, const GroupMarks& near, BondSamples& samples) = 0;
  /// What follows from the bonds of these points is to be computed anew.
  virtual void bonds_changed(std::span<const std::int32_t> points) = 0;
  /// Bonds may fail from now on. What its loop over forces leaves behind for those who look for them; null: nothing.
  virtual const NearestFailure* watch(const BodyDamage& damage) = 0;

  /// Of the last evaluation, where that was one of forces, and leaves any.
  virtual PointFlux point_flux() const noexcept { return {}; }

  /// Evaluations of forces are to mark the groups of bonds that may hold too much energy, from now on; null: no longer. Returns whether they do.
  virtual bool screen(BondScreen* screen) = 0;

  /// Adds bytes, counts and notes of what is left out.
  virtual void report(ModelReport& report) const = 0;
  virtual RestingCounts resting_counts() const noexcept = 0;
};

/// What a term sums up by group of eight points [J], of which each is one rank's.
template <class Energy, class Value>
void add_owned(const Body& body, const std::vector<Energy>& energies, Value&& value, ExactSum& sum) {
  for (std::size_t g = 0; g < energies.size(); ++g)
    for (std::size_t p = g * padding; p < (g + 1) * padding; ++p) {
      if (!body.alive(p)) continue;
      if (body.owns(p)) sum.add(value(energies[g]));
      break;
    }
}
inline void add_owned(const Body& body, const std::vector<double>& energies, ExactSum& sum) {
  add_owned(body, energies, [](double energy) { return energy; }, sum);
}
/// kept[g] <- renewed[g] for the groups in `complete`.
template <class Energy>
void replace(const GroupMarks& complete, const std::vector<Energy>& renewed, std::vector<Energy>& kept) {
  for (std::size_t g = 0; g < kept.size(); ++g)
    if (complete[g]) kept[g] = renewed[g];
}

}  // namespace perikit
