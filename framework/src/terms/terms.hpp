#pragma once
/// All that acts inside of a body: laws at evaluation points or pair forces, zero-energy penalties, and what may be added to them. Their sum
/// as a problem sees it: energies, forces, tangent actions, assembled tangents, and sampled point fields.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "model/formulation.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/model/stabilization.hpp"
#include "perikit/operators/laws.hpp"
#include "terms/pairs/bond_factors.hpp"
#include "terms/term.hpp"

namespace perikit {

class Body;
struct CloudConsistency;
struct Images;
struct Interfaces;

struct TermParts;
/// Makes a term (terms/term.hpp) of what those of the formulation are made of.
using TermMaker = std::function<std::unique_ptr<Term>(const TermParts&)>;

/// What the terms of a formulation are made of. families and laws must outlive them.
struct TermParts {
  Families* families = nullptr;
  Formulation formulation;
  const Laws* laws = nullptr;
  std::shared_ptr<const Stabilization> stabilization;  ///< null: none. Only over point gradients
  bool skip = true;                                    ///< leave out work whose result is known; changes no bit
  bool share = true;                                   ///< savings by symmetry and uniformity; change rounding
  std::shared_ptr<const Interfaces> interfaces;        ///< where materials meet as laminates; null: nowhere
  std::shared_ptr<const Images> images;                ///< of points of the body; null: none
  std::shared_ptr<CloudConsistency> consistency;       ///< null: not asked for. The first terms that get it find it
  std::shared_ptr<const BondFactors> factors;          ///< of the bonds of a pair law; null: the terms find them
  std::vector<TermMaker> further;                      ///< what acts beside the formulation
};

class Terms {
 public:
  explicit Terms(TermParts parts);
  ~Terms();
  const TermParts& parts() const noexcept { return parts_; }
  /// Those of the formulation first.
  std::span<const std::unique_ptr<Term>> all() const noexcept { return terms_; }
  /// Every evaluation of forces marks the bonds that may hold too much energy, from now on; null: no longer. It must outlive these evaluations.
  void screen_bonds(BondScreen* screen) noexcept { screen_ = screen; }

  /// force <- -dE/du [N] (conservative terms), fully overwritten; E of all ranks -> *energy where wanted. Displacements that are on their way have
  /// come when it returns; a motion of the configuration leaves force zero.
  EvaluationStatus forces(const Configuration& at, FieldView force, double* energy);
  /// `forces` and `sample` of the same configuration, bit for bit; where evaluation points are those of both, each is visited once.
  EvaluationStatus forces_and_samples(const Configuration& at, FieldView force, double* energy, PointSamples& samples);
  /// sum += factor times the forces of a region with its gradients, where these are; without data nothing is added. Returns their energy over all ranks [J]: not a
  /// number, and nothing is added, where a point is inadmissible. What is left out is the same whichever bonds have failed. No step ends: nothing is kept. All ranks
  /// must call it.
  double add_forces(const Configuration& at, const Region& region, double factor, FieldView sum);
  /// `forces` where `force` holds the forces before the points `moved` went to where they are now and those of `lost` lost bonds:
  /// what has not changed is left as it is, what has has the same bits. With an energy, those forces must have come with theirs.
  /// On one rank.
  EvaluationStatus renew_forces(const Configuration& at, std::span<const std::int32_t> moved, std::span<const std::int32_t> lost,
                                FieldView force, double* energy);
  /// Kw <- -d(force)/du w [N], fully overwritten. Of a region those of points all of whose evaluation points lie there alone, bit for bit the same, where w is 0
  /// outside of it; anything elsewhere.
  EvaluationStatus tangent(const Configuration& at, ConstFieldView w, FieldView Kw, const Region& region = {});
  /// The tangent couples two points only where a chain of at most so many bonds joins them.
  int coupling_reach() const;
  /// K <- -d(force)/du [N/m] over all live points, constrained ones too. The pattern is made where K has none; one that K has must come
  /// from these terms and stays as it is. Values are overwritten; undefined after a failure.
  EvaluationStatus assemble(const Configuration& at, BlockMatrix& K);
  /// What `assemble` would take, before it takes it: blocks counted in at most 256 rows spread over the body; exact for bodies with
  /// no more points.
  AssembledSize assembled_size();
  EvaluationStatus sample(const Configuration& at, PointSamples& samples);
  /// The volumetric part of the tangent where the map is selective, else null. The terms must outlive it.
  std::unique_ptr<VolumetricRows> volumetric_rows() const;
  /// That an evaluation of this term, or of the first one, met this inadmissible point (field index), or none (-1).
  EvaluationStatus status(std::int64_t bad, const Term* term = nullptr) const;
  /// That a law at this point asks for a step of this share of its length.
  EvaluationStatus too_long_step(std::int64_t point, double factor) const;
  const Body& body() const noexcept;
  /// sum += energies of the groups of eight points of the body that this rank owns.
  void add_owned(std::span<const GroupEnergy> energies, double GroupEnergy::* which, ExactSum& sum) const;

  /// Whether forces come from deformation gradients. Pair laws have none: H and stresses of their samples are made of the bonds of a point.
  bool has_gradients() const noexcept { return parts_.formulation.pairs == nullptr; }
  /// Whether the body is springs between points and nothing else, which have one modulus: Poisson's ratio is theirs.
  bool springs_alone() const noexcept { return parts_.formulation.pairs && !parts_.formulation.dilatation; }
  /// Whether forces are -dE/du, so that the tangent is symmetric.
  bool conservative() const noexcept { return parts_.formulation.force_state == ForceState::variational; }
  /// Whether the tangent is the same at all displacements and times, as long as no bond fails.
  bool constant_tangent() const noexcept;
  /// Condition number of each point's shape tensor (one component; infinite where singular; 0 for pair laws, which have none).
  Field shape_tensor_condition() const;
  /// Lost share of the family's influence by point, sum over broken bonds; 0 where intact (one component).
  Field damage() const;
  ModelReport report() const;
  /// Where laws remember something; null where none does. After their values were replaced: history_restored.
  MaterialPoints* material_points() const noexcept;
  void history_restored();
  /// Its evaluation points, ascending. Failed bonds have none.
  std::vector<HistoryPlace> history_points() const;
  /// What laws remember, at points: see StatefulTerm. 0 where nothing does.
  void average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) const;
  /// The step that the last evaluation of forces ended is done, or given up: see Problem. What laws dissipated in it, over all ranks [J].
  double accept();
  void revert();

  /// Whether something acts on points one by one, as springs to the ground do; and Kw <- its part of the tangent action, fully overwritten.
  bool hold_points() const noexcept;
  EvaluationStatus tangent_of_points(const Configuration& at, ConstFieldView w, FieldView Kw);

  /// K += what of it is symmetric, without negative curvatures: for preconditioners.
  EvaluationStatus add_stiffness_of_points(const Configuration& at, BlockMatrix& K);

  // What is driven: forces that do other work than their energy falls by (terms/term.hpp).
  bool driven(Drive drive) const noexcept;
  bool driven_by_velocity() const noexcept;
  /// force <- those forces alone [N], fully overwritten; their energy over all ranks -> energy.
  EvaluationStatus driven_forces(const Configuration& at, Drive drive, FieldView force, double& energy);

 private:
  template <class Add>
  EvaluationStatus forces_by(Add&& add, const Configuration& at, FieldView force, double* energy);
  /// visit(term) until one returns an inadmissible point.
  template <class Visit>
  EvaluationStatus each_term(Visit&& visit);
  StatefulTerm* stateful() const noexcept;
  /// A point and its law, with its place in words.
  EvaluationStatus at_point(std::int64_t point) const;
  std::size_t groups() const noexcept;
  class PointBlocks;
  struct Assemblies;
  FieldView work_field(int components);
  Assemblies& assemblies();

  TermParts parts_;
  std::vector<std::unique_ptr<Term>> terms_;
  std::vector<std::vector<GroupEnergy>> energies_;  ///< by term, of the last evaluation that asked for them
  ExactSum dissipated_;                             ///< in the step that the last evaluation of forces ended
  std::unique_ptr<Assemblies> assemblies_;  ///< made when asked for
  BondScreen* screen_ = nullptr;
  Field work_;                              ///< made when asked for
};

}  // namespace perikit
