#pragma once
/// Kinematics x materials on a body: energies, forces, tangent actions, sampled point fields.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/families/fracture.hpp"
#include "perikit/operators/laws.hpp"
#include "perikit/model/formulation.hpp"
#include "perikit/model/stabilization.hpp"

namespace perikit {

/// Averages of evaluation-point quantities at points, weighted with W_q over the q that each point owns. Component-major over
/// the body's stride; tensors with the components of the space (cauchy: 9, row-major).
struct PointSamples {
  Field strain_energy_density;   ///< sum W psi / V [J/m^3]
  Field H;                       ///< F - I [-]; H33 included in plane and line spaces
  Field P;                       ///< [Pa]
  Field cauchy;                  ///< [Pa]
  Field von_mises;               ///< [Pa]
};

/// One decision of the set-up: what was left out, why, and what that saves.
struct SkipNote {
  std::string what, why, saves;
};

struct ModelReport {
  std::size_t bytes = 0;                      ///< of families, references and work fields
  std::size_t bonds = 0;                      ///< directed, intact
  std::size_t evaluation_points = 0;
  std::size_t broken_bonds = 0;               ///< cut by pre-cracks
  std::size_t singular_families = 0;          ///< points without a gradient of their own: H = 0
  std::size_t fallbacks = 0;                  ///< evaluation points that use the whole family, or a lower order
  std::size_t dropped_parts = 0;              ///< parts of families without a gradient of their own
  std::vector<SkipNote> skips;
  std::vector<std::string> warnings;          ///< one line each
};

/// What was left out because no wave had arrived, over all evaluations of forces.
struct QuietCounts {
  std::int64_t blocks = 0;                    ///< of points, evaluated or left out
  std::int64_t quiet = 0;                     ///< left out
};

class Model {
 public:
  virtual ~Model() = default;
  /// force <- -dPi/du [N] (conservative models), fully overwritten; strain energy Pi -> *energy where wanted.
  virtual EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) = 0;
  /// Kw <- -d(force)/du w [N], fully overwritten.
  virtual EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) = 0;
  /// K <- -d(force)/du [N/m] over all live points, constrained ones too. The pattern is made where K has none; one that K has must come
  /// from this model and stays as it is. Values are overwritten; undefined after a failure.
  virtual EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K) = 0;
  /// What `assemble` would take, before it takes it: blocks counted in at most 256 rows spread over the body; exact for bodies with
  /// no more points.
  virtual AssembledSize assembled_size() = 0;
  virtual EvaluationStatus sample(ConstFieldView u, PointSamples& samples) = 0;
  /// Whether samples hold H and stresses; pair laws have none (their fields stay empty), only an energy density.
  virtual bool has_gradients() const noexcept { return true; }
  /// Whether forces are -dE/du, so that the tangent is symmetric.
  virtual bool conservative() const noexcept { return true; }
  /// Condition number of each point's shape tensor (one component; infinite where singular; 0 for pair laws, which have none).
  virtual Field shape_tensor_condition() = 0;
  /// Lost share of the family's influence by point, sum over broken bonds; 0 where intact (one component).
  virtual Field damage() = 0;
  virtual ModelReport report() const = 0;
  virtual QuietCounts quiet_counts() const { return {}; }

  // With [damage]. Bonds change here and nowhere else; without damage all of this is empty.
  /// Lowers the integrity of bonds that u stretches too far, and recomputes what depends on them. To be called after every step.
  virtual BondUpdate update_bonds(ConstFieldView /*u*/, const Motion& /*motion*/ = {}) { return {}; }
  /// Every bond that is not as it was at the set-up: run state, for checkpoints.
  virtual std::vector<BondChange> changed_bonds() const { return {}; }
  virtual void restore_bonds(std::span<const BondChange> /*changes*/) {}
  virtual BondChecks bond_checks() const { return {}; }
};

struct ModelParts {
  const Body* body = nullptr;
  Formulation formulation;
  std::shared_ptr<const InfluenceFunction> influence;
  const Laws* laws = nullptr;
  std::shared_ptr<const Stabilization> stabilization;   ///< null: none. Only over point gradients of order 1
  bool skip = true;                           ///< leave out work whose result is known; changes no bit
  bool share = true;                          ///< savings by symmetry and uniformity; change rounding
  const BodyDamage* damage = nullptr;         ///< null: bonds never fail
};

std::unique_ptr<Model> make_model(const ModelParts& parts);

}  // namespace perikit
