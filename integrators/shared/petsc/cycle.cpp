/// The multigrid cycle of PETSc (GAMG) on the rows of several ranks: the one file of perikit that knows PETSc. Parts open this
/// library where several ranks want it (multigrid_cycle.cpp).

#define OMPI_SKIP_MPICXX
#define MPICH_SKIP_MPICXX
#include <petscpc.h>

#include <cstdlib>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../multigrid_cycle.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/plugin/abi.hpp"
#include "unknowns.hpp"

namespace perikit {

namespace {

/// All that PETSc is told beside the matrix, its rigid motions and the product of coarsening. The smoother is its default for
/// GAMG: two steps of a Chebyshev polynomial of D^-1 K. Aggregates are points with all their neighbours, on every level, but for
/// springs that have lost most of their stiffness with their bonds. Single rows are faster than rows that share a pattern
/// (inode).
constexpr const char* options =
    "-pc_type gamg -pc_gamg_aggressive_coarsening 10 -pc_gamg_threshold 0.02 -pc_gamg_reuse_interpolation -mat_no_inode";

/// The way to P^T K P. The fast one of several ranks adds what comes from others as it arrives: from two of them in other bits
/// every time.
const char* product(int ranks) {
  return ranks > 2 ? "backend" : ranks == 2 ? "nonscalable" : "scalable";
}

/// What PETSc said of its last error, where it began.
std::string& complaint() {
  static std::string text;
  return text;
}

PetscErrorCode complain(MPI_Comm, int, const char* function, const char*, PetscErrorCode code, PetscErrorType type,
                        const char* message, void*) {
  if (type == PETSC_ERROR_INITIAL) complaint() = std::string(function) + ": " + (message ? message : "");
  return code;
}

void check(PetscErrorCode code) {
  if (code != 0) throw RunError("PETSc: " + complaint());
}

/// A variable of the environment that is not there while this lives.
class Hidden {
 public:
  explicit Hidden(const char* name) : name_(name) {
    if (const char* value = std::getenv(name)) value_ = value;
    ::unsetenv(name);
  }
  Hidden(const Hidden&) = delete;
  Hidden& operator=(const Hidden&) = delete;
  ~Hidden() {
    if (value_) ::setenv(name_, value_->c_str(), 1);
  }

 private:
  const char* name_;
  std::optional<std::string> value_;
};

/// Once in a process. PETSc takes no options but ours, and leaves signals to the program. It is never finalised: the end of MPI,
/// which is the communicator's, may come long after the last cycle, and nothing of PETSc is open then.
void initialise() {
  PetscBool initialised = PETSC_FALSE;
  check(PetscInitialized(&initialised));
  if (initialised) return;
  const Hidden options_of_user("PETSC_OPTIONS"), more_options_of_user("PETSC_OPTIONS_YAML");
  check(PetscOptionsSetValue(nullptr, "-skip_petscrc", nullptr));
  check(PetscOptionsSetValue(nullptr, "-no_signal_handler", nullptr));
  check(PetscInitializeNoArguments());
  check(PetscPushErrorHandler(complain, nullptr));
  check(PetscOptionsInsertString(nullptr, options));
}

PetscInt count(std::int64_t number) {
  if (number > std::numeric_limits<PetscInt>::max())
    throw RunError(
        "PETSc counts with 32 bits here, and the companion has more unknowns or entries than that; allowed: preconditioner "
        "\"none\"");
  return static_cast<PetscInt>(number);
}

class Cycle final : public MultigridCycle {
 public:
  Cycle() = default;
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;
  /// After an error on this rank alone the others do not come here.
  ~Cycle() override {
    if (std::uncaught_exceptions() == 0) clear();
  }

  bool make(Problem& problem, const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid, bool alike) override {
    if (alike && unknowns_) {
      if (ranks_ != MPI_COMM_NULL) renew(K);
      return true;
    }
    initialise();
    clear();
    unknowns_.emplace(problem, K, free);
    // Ranks without unknowns stay away.
    const MPI_Comm all = *static_cast<MPI_Comm*>(communicator().mpi());
    MPI_Comm_split(all, unknowns_->mine() > 0 ? 0 : MPI_UNDEFINED, communicator().rank(), &ranks_);
    if (ranks_ == MPI_COMM_NULL) return false;
    int size = 0;
    MPI_Comm_size(ranks_, &size);
    check(PetscOptionsSetValue(nullptr, "-matptap_via", product(size)));
    allocate(K);
    fill(K);
    check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
    attach(rigid);
    check(PCCreate(ranks_, &cycle_));
    check(PCSetOperators(cycle_, matrix_, matrix_));
    check(PCSetFromOptions(cycle_));
    check(PCSetUp(cycle_));
    check(MatCreateVecs(matrix_, &z_, &r_));
    return false;
  }

  void apply(ConstFieldView r, FieldView z) override {
    double* values = nullptr;
    const double* result = nullptr;
    if (cycle_) {
      check(VecGetArrayWrite(r_, &values));
      unknowns_->gather(r, values);
      check(VecRestoreArrayWrite(r_, &values));
      check(PCApply(cycle_, r_, z_));
      check(VecGetArrayRead(z_, &result));
    }
    unknowns_->scatter(result, z);
    if (cycle_) check(VecRestoreArrayRead(z_, &result));
  }

 private:
  void clear() {
    VecDestroy(&r_);
    VecDestroy(&z_);
    PCDestroy(&cycle_);
    MatDestroy(&matrix_);
    if (ranks_ != MPI_COMM_NULL) MPI_Comm_free(&ranks_);
  }

  /// Other values of the same pattern. Prolongations are the old ones, matrices of coarse levels and smoothers are made anew.
  void renew(const BlockMatrix& K) {
    fill(K);
    check(PCSetOperators(cycle_, matrix_, matrix_));
    check(PCSetUp(cycle_));
  }

  void allocate(const BlockMatrix& K) {
    const std::int64_t n = unknowns_->mine(), first = unknowns_->before(), d = unknowns_->dimension();
    std::vector<PetscInt> here(static_cast<std::size_t>(n), 0), elsewhere(here);
    std::int64_t entries = 0;
    for (std::int64_t k = 0; k < n; ++k)
      unknowns_->over_row(K, k, [&](std::int64_t column, const double*) {
        ++(column >= first && column < first + n ? here : elsewhere)[static_cast<std::size_t>(k)];
        entries += d * d;
      });
    count(entries);
    const PetscInt block = static_cast<PetscInt>(d);
    check(MatCreate(ranks_, &matrix_));
    check(MatSetSizes(matrix_, count(n * d), count(n * d), count(unknowns_->of_all() * d), count(unknowns_->of_all() * d)));
    check(MatSetType(matrix_, MATAIJ));
    check(MatSetBlockSize(matrix_, block));
    check(MatXAIJSetPreallocation(matrix_, block, here.data(), elsewhere.data(), nullptr, nullptr));
  }

  void fill(const BlockMatrix& K) {
    for (std::int64_t k = 0; k < unknowns_->mine(); ++k)
      unknowns_->over_row(K, k, [&](std::int64_t column, const double* values) {
        const auto row = static_cast<PetscInt>(unknowns_->before() + k), at = static_cast<PetscInt>(column);
        check(MatSetValuesBlocked(matrix_, 1, &row, 1, &at, values, INSERT_VALUES));
      });
    check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
  }

  /// What the coarse levels are to represent.
  void attach(const std::vector<Field>& rigid) {
    std::vector<Vec> motions(rigid.size(), nullptr);
    for (std::size_t m = 0; m < rigid.size(); ++m) {
      check(MatCreateVecs(matrix_, &motions[m], nullptr));
      double* values = nullptr;
      check(VecGetArrayWrite(motions[m], &values));
      unknowns_->gather(rigid[m], values);
      check(VecRestoreArrayWrite(motions[m], &values));
    }
    MatNullSpace space = nullptr;
    check(MatNullSpaceCreate(ranks_, PETSC_FALSE, static_cast<PetscInt>(motions.size()), motions.data(), &space));
    check(MatSetNearNullSpace(matrix_, space));
    check(MatNullSpaceDestroy(&space));
    for (Vec& motion : motions) check(VecDestroy(&motion));
  }

  std::optional<Unknowns> unknowns_;
  MPI_Comm ranks_ = MPI_COMM_NULL;  ///< those that have unknowns
  Mat matrix_ = nullptr;
  PC cycle_ = nullptr;
  Vec r_ = nullptr, z_ = nullptr;
};

}  // namespace

}  // namespace perikit

/// Null where the caller is another perikit.
PERIKIT_EXPORT perikit::MultigridCycle* perikit_petsc_cycle(const char* build_id) {
  if (std::string_view(build_id) != PERIKIT_BUILD) return nullptr;
  return new perikit::Cycle();
}
