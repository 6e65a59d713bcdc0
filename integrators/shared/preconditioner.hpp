#pragma once
/// Preconditioners of the linear systems of load steps: from the assembled tangent, or from a companion of nearest neighbours.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/plugin/parameters.hpp"
#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

class AssembledTangent;

/// An approximate inverse of the tangent on the free components, made at one state and kept over iterations and steps until
/// solves take clearly more iterations for each digit than they took with it at first. The state and the counts are kept with the
/// problem: a restored run makes the same preconditioner again.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  /// Before a solve at u. False where it cannot be made; `failure` says why.
  bool prepare(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  /// z <- M^-1 r, 0 on prescribed components; r and z may be the same field.
  virtual void apply(ConstFieldView r, FieldView z) = 0;
  /// Makes it anew, at u.
  bool renew(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  /// What it is the exact inverse of; null where there is no such matrix.
  virtual const AssembledTangent* tangent() const noexcept { return nullptr; }
  /// True where the tangent at the state of the last prepare() was made convex: the linear equations are then to be those of
  /// tangent().
  bool convex() const noexcept;
  /// Whether the equilibrium u is unstable: by the signs of the factors of the tangent where it has them, else by has_negative_curvature with its help.
  bool finds_unstable(Equilibrium& equilibrium, ConstFieldView u);
  /// To be made anew before the next solve.
  void discard() noexcept { made() = in_hand_ = false; }
  /// Iterations that a solve took to make its residual smaller by the factor `reduction` < 1.
  void took(int iterations, double reduction);

 protected:
  explicit Preconditioner(Problem& problem);
  /// How many times as many iterations a digit as at first it may take before it is made anew.
  virtual double patience() const noexcept { return 2; }
  /// Why it is made: it is worn out; bonds have changed, or there is none; or it is to be what it was where and when it was made, which
  /// is not the present state: after an interruption, and where something in it was older.
  enum class Occasion { worn, bonds, kept };
  /// Makes it there.
  virtual bool make(Equilibrium& equilibrium, const Configuration& at, Occasion occasion, std::string& failure) = 0;
  /// Not -1: something in it comes from one made before, in this load step. A run that goes on from the end of the step cannot
  /// make it so, and therefore none has it in the next one.
  virtual std::int64_t alike_within() const noexcept { return -1; }
  /// Whether it depends on what laws remember, which is another thing in each load step: then none is kept for the next one.
  virtual bool follows_state() const noexcept { return true; }
  /// Iterations a digit of the first solve with it; 0: none yet.
  double first_effort() const noexcept { return numbers_[1]; }

 private:
  double& made() noexcept { return numbers_[0]; }      ///< 0: not, or not to be kept
  double& at_first() noexcept { return numbers_[1]; }  ///< iterations a digit of the first solve with it
  double& lately() noexcept { return numbers_[2]; }    ///< and of the last
  double& wary() noexcept {
    return numbers_[3];
  }                  ///< not 0: the last tangent that it was made of far from equilibrium was indefinite
  double& made_at() noexcept { return numbers_[4]; }   ///< load parameter at which it was made
  FieldView state_;  ///< where it was made
  std::span<double> numbers_;
  bool in_hand_ = false;
  std::int64_t step_ = -1;   ///< in which it was made
};

/// The key `preconditioner` of an integrator. mixed: it has mixed systems (MixedSystem).
void add_preconditioner_key(ParameterTable& table, bool mixed = false);

/// Whether mixed systems are predicted to be faster than what `auto` chooses for displacements alone, where the kinematics has
/// the volumes that they need: the bulk modulus is at least 50 shear moduli somewhere (20 on lattices in 3D, 200 in 2D), and the
/// factorisation does not pay, as never on several ranks. All ranks must call it.
bool mixed_pays(Problem& problem);

/// What the name "auto" stands for, mixed systems apart. All ranks must call it.
std::string automatic_preconditioner(Problem& problem);
/// Largest ratio of bulk to shear modulus. All ranks must call it.
double largest_bulk_ratio(const Problem& problem);

/// Whether the preconditioner of this name needs the assembled tangent, and with it the whole body on one rank.
bool needs_one_rank(const std::string& preconditioner) noexcept;

/// name: "none" (null), "jacobi" (inverses of the points' diagonal blocks), "factorisation" (the factorised tangent), "companion"
/// (a multigrid cycle on springs between nearest neighbours, never the tangent), "auto": the factorisation in 1D, and in 2D for at
/// most 4000 points or bulk moduli beyond 1000 shear moduli, where the assembled tangent takes at most 2 GB; else, and on several ranks, the companion.
/// `chosen` <- what auto chose, and how the companion is solved on several ranks, for the log.
std::unique_ptr<Preconditioner> make_preconditioner(const std::string& name, Problem& problem, std::string& chosen);

/// "companion" of a body whose bulk moduli are at most `most_bulk` shear moduli. `chosen` gets how it is solved on several ranks.
std::unique_ptr<Preconditioner> make_companion_cycle(Problem& problem, double most_bulk, std::string& chosen);

}  // namespace perikit
