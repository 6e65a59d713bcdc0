#pragma once
/// Direct solution of linear systems with assembled tangents: the one place that knows SuiteSparse.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "perikit/core/block_matrix.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/memory.hpp"

namespace perikit {

/// K x = b on the free components, K an assembled tangent: a supernodal Cholesky factorisation (CHOLMOD) where K is symmetric and
/// positive definite, an LU factorisation with pivoting (UMFPACK) elsewhere. The fill-reducing ordering is found on the graph of
/// points, once for all matrices of the same pattern and mask. BLAS runs on one thread, so that results do not depend on threads.
class SparseSolver {
 public:
  /// Factors that need more than `memory` bytes are refused while they are patterns.
  explicit SparseSolver(double memory = memory_limit());
  ~SparseSolver();
  SparseSolver(const SparseSolver&) = delete;
  SparseSolver& operator=(const SparseSolver&) = delete;

  /// Asked ten times a second from now on while an ordering or a factorisation takes time: false gives it up, and nothing can be solved any more.
  void watch(std::function<bool()> goes_on);
  /// False where K is singular to working accuracy or memory is short; `failure` says so. `free`: 1 on free components,
  /// K.dimension components. The pattern of K and the mask must be those of the first call.
  bool factorise(const BlockMatrix& K, ConstFieldView free, std::string& failure);
  /// The same, but where K is not symmetric and positive definite there is no factorisation, and `failure` stays empty.
  bool factorise_definite(const BlockMatrix& K, ConstFieldView free, std::string& failure);
  /// x <- K^-1 b on free components, 0 elsewhere. b and x may be the same field.
  void solve(ConstFieldView b, FieldView x);

  bool factorised() const noexcept;
  /// True where the last factorisation was Cholesky's.
  bool positive_definite() const noexcept;
  /// Unknowns, and numbers in the factors of the last factorisation.
  std::size_t unknowns() const noexcept;
  double factor_entries() const noexcept;
  /// Of the last factorisation, estimated from its pivots: near 1e-16 nothing is left of the answer.
  double reciprocal_condition() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// order[k] <- the k-th unknown to eliminate, so that factors stay sparse: the better of minimum degree (AMD) and nested
/// dissection (METIS). Compressed columns of n unknowns, structurally symmetric. False where memory is short.
bool find_elimination_order(std::int64_t n, std::int64_t* first, std::int64_t* row, std::int64_t* order);

}  // namespace perikit
