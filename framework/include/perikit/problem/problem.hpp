#pragma once
/// What an integrator runs: values, which it may read and change, and operations, which the terms of the problem do for it.

#include <cstddef>
#include <memory>
#include <vector>

#include "perikit/body/points.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/model/configuration.hpp"
#include "perikit/problem/constraints.hpp"
#include "perikit/problem/damaged_part.hpp"
#include "perikit/problem/image_map.hpp"
#include "perikit/problem/loads.hpp"
#include "perikit/problem/masses.hpp"
#include "perikit/problem/state.hpp"
#include "perikit/problem/volumetric_part.hpp"
#include "perikit/problem/weakening_bonds.hpp"

namespace perikit {

struct ProblemValues {
  const Body& body;
  const Laws& laws;
  State state;
  Masses masses;
  Constraints constraints;
  Loads loads;
  const ImageMap* images = nullptr;   ///< null: the body has none. They are not owned; their displacements are constrained
  Points points{body};                ///< of all bodies
};

/// Of bonds; 1, 1 where there are none.
struct StretchRange {
  double least = 1, largest = 1;
};

/// Values are the same for all who look at a problem; operations may be wrapped by those who look on or interfere.
class Problem {
 public:
  /// `values` must outlive the problem.
  explicit Problem(ProblemValues& values) noexcept : values_(values) {}
  virtual ~Problem() = default;

  /// All that most need to know of bodies: where fields hold which points.
  const Points& points() const noexcept { return values_.points; }
  const Body& body() const noexcept { return values_.body; }
  const Laws& laws() const noexcept { return values_.laws; }
  State& state() noexcept { return values_.state; }
  const Masses& masses() const noexcept { return values_.masses; }
  Constraints& constraints() noexcept { return values_.constraints; }
  const Loads& loads() const noexcept { return values_.loads; }
  const ImageMap* images() const noexcept { return values_.images; }
  int dimension() const noexcept { return points().dimension(); }
  /// That of the state: its displacements at its time.
  Configuration configuration() const noexcept { return {values_.state.displacement(), values_.state.time}; }
  /// A new field of `dimension` components, zero, with the margins that the operations need: theirs must all come from here.
  Field make_field() const { return points().make_field(dimension()); }

  /// Values of the owners of points -> ghosts of a field that has at most `dimension` components and is nobody else's: in fields of the problem
  /// ghosts are zero. All ranks must call it.
  virtual void share(FieldView field) = 0;

  /// force <- internal forces [N]; strain energy -> *energy where wanted. Where a motion of the configuration makes the displacements, all points have moved
  /// when it returns, and it need not find force zero on those that move.
  virtual EvaluationStatus evaluate_forces(const Configuration& at, FieldView force, double* energy) = 0;
  /// force <- what acts from outside [N], fully overwritten: loads, of which some follow the surface.
  virtual EvaluationStatus external_forces(const Configuration& at, FieldView force) = 0;
  /// Kw <- Kw - d(external force)/du . w, of loads that follow the surface: exact but for plane and line stress, where the
  /// thickness comes in by differences. Assembled tangents leave it out.
  virtual EvaluationStatus add_load_stiffness(const Configuration& at, ConstFieldView w, FieldView Kw) = 0;
  /// Kw <- dF/du . w, exact; K = -d(force)/du, so that Kw is the stiffness times w [N].
  virtual EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) = 0;
  /// K <- -d(force)/du [N/m] over all live points, constrained ones too. The pattern is made where K has none; one that K
  /// has must come from this problem. Values are overwritten; undefined after a failure. Points at bonds that have failed are
  /// held by 1e-9 of the mean stiffness of a point: pieces that nothing else holds then stay where they are, and K is not
  /// singular.
  virtual EvaluationStatus assemble_tangent(const Configuration& at, BlockMatrix& K) = 0;
  /// What assemble_tangent would take, at little cost: for refusing before the memory runs out.
  virtual AssembledSize assembled_size() = 0;
  /// K <- the stiffness at u of springs between nearest neighbours with the moduli of the body [N/m]: symmetric, cheap, spectrally
  /// close to the tangent. For preconditioners. Pattern and values as with assemble_tangent. Bulk moduli count as at most so many
  /// shear moduli.
  virtual void assemble_companion(ConstFieldView u, BlockMatrix& K, double most_bulk) = 0;
  /// What of the tangent resists changes of the volumes of points; null where volumes are not those of points. The problem must
  /// outlive it.
  virtual std::unique_ptr<VolumetricPart> volumetric_part() = 0;
  /// False where the stiffness can change during the run (nonlinear laws, failing bonds): estimates of it do not last.
  virtual bool constant_stiffness() const noexcept = 0;

  /// The step that the last evaluation of forces ended is done: what laws remember at its end is where the next one begins, and what they dissipated
  /// counts. Nothing where none has ended since the last one. All ranks must call it.
  virtual void accept() = 0;
  /// That step is given up: what laws remember is what it was at its beginning.
  virtual void revert() = 0;
  /// With [damage]: lets bonds fail that are beyond their limits, after a step that took `elapsed` [s]. Returns true when bonds changed. In quasi-static runs
  /// `at` is an equilibrium, which is no longer one then: as long as bonds change, the step is not over, and later rounds have elapsed = 0.
  /// velocity: of explicit schemes, of the half step that led here. Bonds then failed inside of the step: the displacements and internal forces of the state, the
  /// energies and this velocity become what they are with bonds that acted until then. To be called right after the evaluation of
  /// the forces and `accept`, before anything is made of these forces. All ranks must call it.
  virtual bool update_bonds(const Configuration& at, double elapsed, FieldView velocity = {}) = 0;
  /// Both, at the end of a step of explicit schemes.
  bool advance(double time_step, FieldView velocity = {}) {
    accept();
    return update_bonds(configuration(), time_step, velocity);
  }
  /// Bonds that have failed so far, of all ranks. All ranks must call it.
  virtual std::int64_t failed_bonds() const { return 0; }
  /// Bonds that weaken gradually, for solvers that forecast how far they do; as long as it lives, advance() leaves that to it. Null where none
  /// do, and on several ranks. The problem must outlive it.
  virtual std::unique_ptr<WeakeningBonds> weakening_bonds() = 0;
  /// Where the last update let bonds fail or weaken and the stiffness may have grown by that; null where it has not. The problem must
  /// outlive it. All ranks must call it.
  virtual std::unique_ptr<DamagedPart> damaged_part() = 0;
  /// The least and the largest stretch of intact bonds between neighbouring points at u: how far the body has deformed, at about a hundredth
  /// of the cost of forces. All ranks must call it.
  virtual StretchRange stretches(ConstFieldView u) = 0;
  /// With [damage]: the bonds as they are on this rank, to return to where a step is given up. Empty without.
  virtual std::vector<std::byte> bonds() const = 0;
  /// Bonds of `bonds`, not empty. All ranks must call it.
  virtual void restore_bonds(std::span<const std::byte> bonds) = 0;

 private:
  ProblemValues& values_;
};

}  // namespace perikit
