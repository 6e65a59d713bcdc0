#include "preconditioner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "assembled_tangent.hpp"
#include "multigrid_cycle.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/problem/motion.hpp"
#include "perikit/sdk/stability.hpp"

namespace perikit {

namespace {

class Factorisation final : public Preconditioner {
 public:
  explicit Factorisation(Problem& problem) : Preconditioner(problem) {}
  void apply(ConstFieldView r, FieldView z) override { tangent_.solve(r, z); }
  const AssembledTangent* tangent() const noexcept override { return &tangent_; }

 private:
  bool make(Equilibrium& equilibrium, const Configuration& at, Occasion occasion, std::string& failure) override {
    return tangent_.make(equilibrium, at, occasion != Occasion::kept, failure);
  }
  AssembledTangent tangent_;
};

/// Inverses of the diagonal blocks, prescribed components left out.
class BlockJacobi final : public Preconditioner {
 public:
  explicit BlockJacobi(Problem& problem) : Preconditioner(problem) {}

  void apply(ConstFieldView r, FieldView z) override {
    if (z.data != r.data) fill(0.0, z);
    parallel_for(point_.size(), [&](std::size_t row) {
      const double* inverse = &inverse_[row * static_cast<std::size_t>(d_ * d_)];
      const auto p = static_cast<std::size_t>(point_[row]);
      double sum[3] = {};
      for (int a = 0; a < d_; ++a)
        for (int c = 0; c < d_; ++c) sum[a] += inverse[a * d_ + c] * r.component(c)[p];
      for (int a = 0; a < d_; ++a) z.component(a)[p] = sum[a];
    });
  }

 private:
  bool make(Equilibrium& equilibrium, const Configuration& at, Occasion, std::string& failure) override {
    if (!tangent_.assemble(equilibrium, at, false, failure)) return false;
    const BlockMatrix& K = tangent_.matrix();
    const ConstFieldView free = equilibrium.free();
    d_ = K.dimension;
    point_ = K.point;
    const auto size = static_cast<std::size_t>(d_ * d_);
    inverse_.resize(K.rows() * size);
    parallel_for(K.rows(), [&](std::size_t row) {
      const auto begin = K.column.begin() + K.row_first[row], end = K.column.begin() + K.row_first[row + 1];
      const std::int64_t block = std::lower_bound(begin, end, static_cast<std::int32_t>(row)) - K.column.begin();
      invert(&K.values[static_cast<std::size_t>(block) * size], free, static_cast<std::size_t>(point_[row]),
             &inverse_[row * size]);
    });
    return true;
  }

  /// Gauss-Jordan elimination over the free components; rows and columns of the others are 0. A vanishing pivot (nothing holds
  /// the point) counts as free of stiffness: its inverse is 0.
  void invert(const double* block, ConstFieldView free, std::size_t p, double* inverse) const {
    double a[3][6] = {};
    double largest = 0;
    for (int i = 0; i < d_; ++i) {
      a[i][d_ + i] = 1;
      for (int j = 0; j < d_; ++j) {
        if (free.component(i)[p] != 0 && free.component(j)[p] != 0) a[i][j] = block[i * d_ + j];
        largest = std::max(largest, std::abs(a[i][j]));
      }
    }
    bool kept[3];
    for (int k = 0; k < d_; ++k) {
      kept[k] = free.component(k)[p] != 0 && std::abs(a[k][k]) > 1e-12 * largest;
      if (!kept[k]) continue;
      const double pivot = a[k][k];
      for (int j = 0; j < 2 * d_; ++j) a[k][j] /= pivot;
      for (int i = 0; i < d_; ++i) {
        if (i == k) continue;
        const double factor = a[i][k];
        for (int j = 0; j < 2 * d_; ++j) a[i][j] -= factor * a[k][j];
      }
    }
    for (int i = 0; i < d_; ++i)
      for (int j = 0; j < d_; ++j) inverse[i * d_ + j] = kept[i] && kept[j] ? a[i][d_ + j] : 0.0;
  }

  AssembledTangent tangent_;
  int d_ = 0;
  std::vector<std::int32_t> point_;
  std::vector<double> inverse_;
};

/// A multigrid cycle on springs between nearest neighbours: time and memory grow with the points, iterations hardly. Where bonds
/// have failed within a load step it is made like the last one, unless that one took more iterations than one of its own.
class CompanionCycle final : public Preconditioner {
 public:
  CompanionCycle(Problem& problem, double most_bulk, std::string& how)
      : Preconditioner(problem), most_bulk_(most_bulk), cycle_(make_multigrid_cycle(problem, how)) {}

  void apply(ConstFieldView r, FieldView z) override { cycle_->apply(r, z); }

 private:
  bool follows_state() const noexcept override { return false; }
  bool make(Equilibrium& equilibrium, const Configuration& at, Occasion occasion, std::string& failure) override {
    Problem& problem = equilibrium.problem();
    const std::int64_t step = problem.state().step;
    cycle_->watch([&equilibrium] { return equilibrium.goes_on(); });
    if (!alike_) own_effort_ = first_effort();
    const bool alike = occasion == Occasion::bonds && step == step_ && first_effort() <= 1.05 * own_effort_;
    const ConstFieldView u = at.u();
    problem.assemble_companion(u, springs_, most_bulk_);
    if (equilibrium.goes_on()) alike_ = cycle_->make(problem, springs_, equilibrium.free(), rigid_motions(problem.points(), u), alike);
    step_ = occasion == Occasion::kept ? -1 : step;
    if (!equilibrium.stopped()) return true;
    failure = equilibrium.failure();
    return false;
  }
  std::int64_t alike_within() const noexcept override { return alike_ ? step_ : -1; }
  double patience() const noexcept override { return 1.3; }  // it is cheap

  double most_bulk_;  ///< in shear moduli
  std::int64_t step_ = -1;  ///< in which it was made
  bool alike_ = false;
  double own_effort_ = 0;  ///< iterations a digit of the last one that was not made like another
  BlockMatrix springs_;
  std::unique_ptr<MultigridCycle> cycle_;
};

/// Largest over smallest shear modulus. All ranks must call it.
double shear_contrast(const Problem& problem) {
  double largest = 0, largest_inverse = 0;
  for (const std::int32_t p : problem.points().owned()) {
    const double mu = problem.laws().moduli(static_cast<std::size_t>(p)).mu;
    largest = std::max(largest, mu);
    if (mu > 0) largest_inverse = std::max(largest_inverse, 1 / mu);
  }
  return communicator().largest(largest) * communicator().largest(largest_inverse);
}

/// Whether the factors of the tangent are made in the time of some tens of tangent actions, or the companion, which knows nothing of stiffness
/// against changes of volume, would need too many of them (measured: framework/docs/performance.md). Not on several ranks: the assembled tangent
/// needs the whole body on one.
bool factorisation_pays(Problem& problem) {
  if (problem.dimension() == 3 || communicator().size() > 1) return false;
  const bool few = problem.points().size() <= 4000;
  const bool resists_volume = largest_bulk_ratio(problem) > 1000 && problem.points().space() != Space::plane_stress;
  return (problem.dimension() == 1 || few || resists_volume) && static_cast<double>(problem.assembled_size().bytes) <= 2e9;
}

}  // namespace

Preconditioner::Preconditioner(Problem& problem)
    : state_(problem.state().declare("preconditioner_state")),
      numbers_(problem.state().declare_numbers("preconditioner", 5)) {}

bool Preconditioner::prepare(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  Problem& problem = equilibrium.problem();
  const bool worn = !problem.constant_stiffness() && lately() > patience() * at_first() + 2;
  const bool older = problem.laws().state_components() > 0 && follows_state() && step_ != problem.state().step;
  if (made() == 0 || worn || older || (wary() != 0 && far_from(equilibrium))) return renew(equilibrium, u, failure);
  if (alike_within() >= 0 && alike_within() != equilibrium.problem().state().step) in_hand_ = false;
  return in_hand_ || (in_hand_ = make(equilibrium, Configuration(state_, made_at()), Occasion::kept, failure));
}

bool Preconditioner::renew(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  copy(u, state_);
  step_ = equilibrium.problem().state().step;
  made_at() = equilibrium.parameter();
  const Occasion occasion = made() == 0 ? Occasion::bonds : Occasion::worn;
  in_hand_ = make(equilibrium, equilibrium.at(state_), occasion, failure);
  at_first() = lately() = 0;
  // A convex tangent serves at its own state only.
  made() = in_hand_ && !convex() ? 1 : 0;
  if (far_from(equilibrium)) wary() = convex() ? 1 : 0;
  return in_hand_;
}

bool Preconditioner::convex() const noexcept {
  return tangent() && tangent()->convex();
}

bool Preconditioner::finds_unstable(Equilibrium& equilibrium, ConstFieldView u) {
  std::string failure;
  if (tangent()) return renew(equilibrium, u, failure) && tangent()->indefinite();
  const bool there = prepare(equilibrium, u, failure);
  return has_negative_curvature(equilibrium, u, there ? [this](ConstFieldView r, FieldView z) { apply(r, z); } : PreconditionerAction());
}

void Preconditioner::took(int iterations, double reduction) {
  // A solve that gains less than a digit says little of its speed.
  const double digits = std::max(1.0, -std::log10(std::max(reduction, 1e-16)));
  lately() = iterations / digits;
  if (at_first() == 0) at_first() = lately();
}

void add_preconditioner_key(ParameterTable& table, bool mixed) {
  std::vector<std::string> names = {"auto", "none", "jacobi", "factorisation", "companion"};
  if (mixed) names.push_back("mixed");
  const std::string what =
      "Of Krylov solvers: the assembled tangent (its factors, or the blocks of its diagonal), or springs between nearest "
      "neighbours (companion)";
  table.choice("preconditioner", names, what + (mixed ? "; mixed: those, and pressures as further unknowns, for selective kinematics." : "."))
      .by_default("\"auto\"");
}

bool mixed_pays(Problem& problem) {
  // Measured: integrators/jfnk/README.md. Lattices need not store the rows of volumes.
  const double least_ratio = problem.dimension() == 2 ? 200 : problem.points().on_lattices() ? 20 : 50;
  // Where a soft material shares evaluation points with one that is far stiffer, springs between nearest neighbours do not stand for them.
  constexpr double most_contrast = 30;
  return problem.dimension() > 1 && largest_bulk_ratio(problem) >= least_ratio && shear_contrast(problem) <= most_contrast && !factorisation_pays(problem);
}

double largest_bulk_ratio(const Problem& problem) {
  double largest = 0;
  for (const std::int32_t p : problem.points().owned()) {
    const Moduli moduli = problem.laws().moduli(static_cast<std::size_t>(p));
    if (moduli.mu > 0) largest = std::max(largest, moduli.bulk() / moduli.mu);
  }
  return communicator().largest(largest);
}

std::string automatic_preconditioner(Problem& problem) {
  return factorisation_pays(problem) ? "factorisation" : "companion";
}

bool needs_one_rank(const std::string& preconditioner) noexcept {
  return preconditioner == "factorisation" || preconditioner == "jacobi";
}

std::unique_ptr<Preconditioner> make_preconditioner(const std::string& name, Problem& problem, std::string& chosen) {
  chosen = name == "auto" ? automatic_preconditioner(problem) : name;
  if (chosen == "factorisation") return std::make_unique<Factorisation>(problem);
  if (chosen == "companion") return make_companion_cycle(problem, std::numeric_limits<double>::infinity(), chosen);
  if (chosen == "jacobi") return std::make_unique<BlockJacobi>(problem);
  return nullptr;
}

std::unique_ptr<Preconditioner> make_companion_cycle(Problem& problem, double most_bulk, std::string& chosen) {
  std::string how;
  auto companion = std::make_unique<CompanionCycle>(problem, most_bulk, how);
  if (!how.empty()) chosen += ", " + how;
  return companion;
}

}  // namespace perikit
