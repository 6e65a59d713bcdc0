#include "sparse_solver.hpp"

#include <cholmod.h>
#include <fmt/format.h>
#include <omp.h>
#include <sys/resource.h>
#include <umfpack.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "free_matrix.hpp"
#include "perikit/core/errors.hpp"
#include "work_apart.hpp"

extern "C" void openblas_set_num_threads(int) __attribute__((weak));
extern "C" void* blas_memory_alloc(int) __attribute__((weak));
extern "C" void blas_memory_free(void*) __attribute__((weak));

namespace perikit {

static_assert(sizeof(SuiteSparse_long) == sizeof(FreeMatrix::Index));

namespace {

SuiteSparse_long* as_long(std::vector<FreeMatrix::Index>& v) {
  return reinterpret_cast<SuiteSparse_long*>(v.data());
}

/// Memory that OpenBLAS takes with its first product. Where it gets none it asks again, and for ever.
constexpr double dense_memory = 130.0 * (1 << 20);

/// What a limit of the address space leaves [bytes]; infinite without one.
double address_space_left() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::numeric_limits<double>::infinity();
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return static_cast<double>(limit.rlim_cur) - pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// CHOLMOD moves the numbers of each supernode with four threads, however many there are: for some thousand unknowns waking them takes four
/// times as long as all the rest. No parallel regions as long as this lives.
class OneThread {
 public:
  OneThread() { omp_set_max_active_levels(0); }
  ~OneThread() { omp_set_max_active_levels(levels_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int levels_ = omp_get_max_active_levels();
};

/// OpenBLAS takes its memory with the first product, keeps it for the next ones, and tries for ever where there is none. So it takes it here, while what is
/// left is known: threads and factors take of it, too.
void take_dense_memory() {
  static bool held = false;
  if (held) return;
  // Beside it the factors of a small body: where there are some MB less, libraries below fail without a word.
  constexpr double beside = 24e6;
  if (const double left = address_space_left(); left < dense_memory + beside)
    throw RunError(fmt::format("not enough memory: dense products and factors take {:.3g} MB, and the limit of this process leaves {:.3g} MB", (dense_memory + beside) / 1e6, left / 1e6));
  if (blas_memory_alloc && blas_memory_free) blas_memory_free(blas_memory_alloc(0));
  held = true;
}

/// A view of compressed columns for CHOLMOD, upper triangle; pattern only where value is null.
cholmod_sparse view(std::size_t n, FreeMatrix::Index* first, FreeMatrix::Index* row, double* value) {
  cholmod_sparse A{};
  A.nrow = A.ncol = n;
  A.nzmax = static_cast<std::size_t>(first[n]);
  A.p = first;
  A.i = row;
  A.x = value;
  A.stype = 1;
  A.itype = CHOLMOD_LONG;
  A.xtype = value ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = A.packed = 1;
  return A;
}

}  // namespace

bool find_elimination_order(std::int64_t n, std::int64_t* first, std::int64_t* row, std::int64_t* order) {
  cholmod_common common;
  cholmod_l_start(&common);
  common.print = 0;
  cholmod_sparse graph = view(static_cast<std::size_t>(n), first, row, nullptr);
  cholmod_factor* factor = cholmod_l_analyze(&graph, &common);
  if (factor) std::copy_n(static_cast<const SuiteSparse_long*>(factor->Perm), n, order);
  const bool found = factor != nullptr;
  cholmod_l_free_factor(&factor, &common);
  cholmod_l_finish(&common);
  return found;
}

/// What UMFPACK says of its factors.
struct LuResult {
  SuiteSparse_long status = UMFPACK_OK;
  double info[UMFPACK_INFO];
};

struct SparseSolver::Implementation {
  cholmod_common common{};
  FreeMatrix free;
  std::vector<FreeMatrix::Index> upper_first, upper_row, first, row;
  std::vector<double> value, right, answer;
  cholmod_factor* cholesky = nullptr;
  cholmod_dense *solution = nullptr, *work_y = nullptr, *work_e = nullptr;
  void *symbolic = nullptr, *numeric = nullptr;
  bool analysed = false, definite = false, ready = false;
  std::function<bool()> goes_on;
  bool given_up = false;
  double entries = 0, limit, reciprocal_condition = 1;

  explicit Implementation(double memory) : limit(memory) {
    if (openblas_set_num_threads) {
      openblas_set_num_threads(1);
      take_dense_memory();
    }
    cholmod_l_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.quick_return_if_not_posdef = 1;
  }
  ~Implementation() {
    cholmod_l_free_factor(&cholesky, &common);
    for (cholmod_dense** dense : {&solution, &work_y, &work_e}) cholmod_l_free_dense(dense, &common);
    cholmod_l_finish(&common);
    umfpack_dl_free_symbolic(&symbolic);
    umfpack_dl_free_numeric(&numeric);
  }

  template <class Work>
  bool done(Work work) {
    const bool ended = work_apart(goes_on, std::move(work));
    given_up = given_up || !ended;
    return ended;
  }

  /// The ordering of the points that CHOLMOD likes best (AMD, or METIS' nested dissection), component by component.
  std::vector<FreeMatrix::Index> ordering(const BlockMatrix& K) {
    std::vector<FreeMatrix::Index> begin(1, 0), rows;
    for (std::size_t r = 0; r < K.rows(); ++r) {
      for (std::int64_t b = K.row_first[r];
           b < K.row_first[r + 1] && K.column[static_cast<std::size_t>(b)] <= static_cast<std::int32_t>(r); ++b) {
        rows.push_back(K.column[static_cast<std::size_t>(b)]);
      }
      begin.push_back(static_cast<FreeMatrix::Index>(rows.size()));
    }
    struct Graph {
      std::vector<FreeMatrix::Index> begin, rows, points;
      bool ordered = false;
    };
    const auto graph = std::make_shared<Graph>(Graph{std::move(begin), std::move(rows), std::vector<FreeMatrix::Index>(K.rows())});
    std::vector<FreeMatrix::Index> order;
    const bool ended = done([graph] {
      graph->ordered = find_elimination_order(static_cast<FreeMatrix::Index>(graph->points.size()), graph->begin.data(), graph->rows.data(), graph->points.data());
    });
    if (!ended || !graph->ordered) return order;
    for (const FreeMatrix::Index point : graph->points)
      for (int a = 0; a < K.dimension; ++a) {
        const FreeMatrix::Index unknown = free.unknown(static_cast<std::size_t>(point), a);
        if (unknown >= 0) order.push_back(unknown);
      }
    return order;
  }

  bool analyse(const BlockMatrix& K, std::string& failure) {
    free.pattern(K, true, upper_first, upper_row);
    std::vector<FreeMatrix::Index> order = ordering(K);
    if (given_up) return stopped(failure);
    cholmod_sparse A = view(free.unknowns(), upper_first.data(), upper_row.data(), nullptr);
    // Only the given ordering is tried from here on.
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.postorder = 1;
    if (!order.empty()) {
      const auto kept = std::make_shared<std::vector<FreeMatrix::Index>>(std::move(order));
      if (!done([this, A, kept]() mutable { cholesky = cholmod_l_analyze_p(&A, as_long(*kept), nullptr, 0, &common); })) return stopped(failure);
    }
    if (!cholesky)
      failure = fmt::format("CHOLMOD cannot analyse a matrix of {} unknowns: {}", free.unknowns(),
                            common.status == CHOLMOD_OUT_OF_MEMORY ? "not enough memory" : "an internal error");
    if (cholesky && !affordable(failure)) cholmod_l_free_factor(&cholesky, &common);
    return cholesky != nullptr;
  }

  /// Memory that a system promises and does not have ends a program without a word: the factor is refused while it is a pattern.
  bool affordable(std::string& failure) const {
    const double numbers = cholesky->is_super ? static_cast<double>(cholesky->xsize) : common.lnz;
    if (numbers * sizeof(double) <= limit) return true;
    failure = fmt::format("the Cholesky factor of {} unknowns needs {:.3g} GB; this machine offers {:.3g} GB", free.unknowns(),
                          numbers * sizeof(double) / 1e9, limit / 1e9);
    return false;
  }

  static bool stopped(std::string& failure) {
    failure = "the run was stopped";
    return false;
  }

  bool factorise_symmetric(const BlockMatrix& K, std::string& failure) {
    if (!cholesky && !analyse(K, failure)) return false;
    free.values(K, true, upper_first, value);
    cholmod_sparse A = view(free.unknowns(), upper_first.data(), upper_row.data(), value.data());
    const bool ended = done([this, A]() mutable {
      const OneThread one;
      cholmod_l_factorize(&A, cholesky, &common);
    });
    if (!ended) return stopped(failure);
    definite = common.status == CHOLMOD_OK && cholesky->minor == free.unknowns();
    if (common.status == CHOLMOD_OUT_OF_MEMORY)
      failure =
          fmt::format("not enough memory for the Cholesky factor of {} unknowns ({:.3g} numbers)", free.unknowns(), common.lnz);
    entries = common.lnz;
    if (definite) reciprocal_condition = cholmod_l_rcond(cholesky, &common);
    return definite;
  }

  bool factorise_general(const BlockMatrix& K, std::string& failure) {
    if (first.empty()) free.pattern(K, false, first, row);
    free.values(K, false, first, value);
    umfpack_dl_free_numeric(&numeric);
    const auto n = static_cast<SuiteSparse_long>(free.unknowns());
    double info[UMFPACK_INFO];
    SuiteSparse_long status = UMFPACK_OK;
    const auto result = std::make_shared<LuResult>();
    if (!symbolic) {
      if (!done([this, n, result] { result->status = umfpack_dl_symbolic(n, n, as_long(first), as_long(row), value.data(), &symbolic, nullptr, result->info); }))
        return stopped(failure);
      status = result->status;
    }
    if (status == UMFPACK_OK) {
      if (!done([this, result] { result->status = umfpack_dl_numeric(as_long(first), as_long(row), value.data(), symbolic, &numeric, nullptr, result->info); }))
        return stopped(failure);
      status = result->status;
      std::copy_n(result->info, UMFPACK_INFO, info);
    }
    if (status == UMFPACK_OK) {
      entries = info[UMFPACK_LNZ] + info[UMFPACK_UNZ];
      reciprocal_condition = info[UMFPACK_RCOND];
      return true;
    }
    failure = status == UMFPACK_WARNING_singular_matrix ? "the tangent is singular: part of the body is free to move"
              : status == UMFPACK_ERROR_out_of_memory   ? fmt::format("not enough memory for the LU factors of {} unknowns", n)
                                                        : fmt::format("UMFPACK ends with status {}", status);
    return false;
  }
};

SparseSolver::SparseSolver(double memory) : implementation_(std::make_unique<Implementation>(memory)) {}
SparseSolver::~SparseSolver() {
  if (implementation_->given_up) implementation_.release();   // a thread is still at work on it
}

void SparseSolver::watch(std::function<bool()> goes_on) {
  implementation_->goes_on = std::move(goes_on);
}

bool SparseSolver::factorise_definite(const BlockMatrix& K, ConstFieldView free, std::string& failure) {
  Implementation& own = *implementation_;
  if (!own.analysed) {
    own.free = FreeMatrix(K, free);
    own.right.resize(own.free.unknowns());
    own.answer.resize(own.free.unknowns());
    own.analysed = true;
  }
  own.definite = false;
  own.ready = own.free.unknowns() == 0;
  if (own.ready) return true;
  failure.clear();
  return own.ready = K.symmetric && own.factorise_symmetric(K, failure);
}

bool SparseSolver::factorise(const BlockMatrix& K, ConstFieldView free, std::string& failure) {
  if (factorise_definite(K, free, failure)) return true;
  return failure.empty() && (implementation_->ready = implementation_->factorise_general(K, failure));
}

void SparseSolver::solve(ConstFieldView b, FieldView x) {
  Implementation& own = *implementation_;
  const std::size_t n = own.free.unknowns();
  for (std::size_t k = 0; k < n; ++k) own.right[k] = b.data[own.free.place(k)];
  const double* answer = own.answer.data();
  if (n > 0 && own.definite) {
    cholmod_dense right{};
    right.nrow = right.nzmax = right.d = n;
    right.ncol = 1;
    right.x = own.right.data();
    right.xtype = CHOLMOD_REAL;
    right.dtype = CHOLMOD_DOUBLE;
    cholmod_l_solve2(CHOLMOD_A, own.cholesky, &right, nullptr, &own.solution, nullptr, &own.work_y, &own.work_e, &own.common);
    answer = static_cast<const double*>(own.solution->x);
  } else if (n > 0) {
    umfpack_dl_solve(UMFPACK_A, as_long(own.first), as_long(own.row), own.value.data(), own.answer.data(), own.right.data(),
                     own.numeric, nullptr, nullptr);
  }
  std::fill_n(x.data, x.size(), 0.0);
  for (std::size_t k = 0; k < n; ++k) x.data[own.free.place(k)] = answer[k];
}

bool SparseSolver::factorised() const noexcept {
  return implementation_->ready;
}
bool SparseSolver::positive_definite() const noexcept {
  return implementation_->definite;
}
std::size_t SparseSolver::unknowns() const noexcept {
  return implementation_->free.unknowns();
}
double SparseSolver::reciprocal_condition() const noexcept {
  return implementation_->reciprocal_condition;
}
double SparseSolver::factor_entries() const noexcept {
  return implementation_->entries;
}

}  // namespace perikit
