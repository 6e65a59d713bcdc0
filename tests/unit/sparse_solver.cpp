/// Direct solution of hand-made block matrices against dense algebra.

#include "integrators/shared/sparse_solver.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <random>

#include "perikit/core/parallel.hpp"

using namespace perikit;

namespace {

constexpr int dimension = 2;
constexpr std::size_t rows = 40, stride = 48;

/// Rows couple with rows at most three away; points lie apart in the field. `shift` on the diagonal decides about definiteness.
BlockMatrix banded(bool symmetric, double shift, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  BlockMatrix K;
  K.dimension = dimension;
  K.symmetric = symmetric;
  K.row_first.push_back(0);
  for (std::size_t r = 0; r < rows; ++r) {
    K.point.push_back(static_cast<std::int32_t>(r + r / 10));
    for (std::size_t c = r < 3 ? 0 : r - 3; c < std::min(rows, r + 4); ++c) K.column.push_back(static_cast<std::int32_t>(c));
    K.row_first.push_back(static_cast<std::int64_t>(K.column.size()));
  }
  Eigen::MatrixXd full = Eigen::MatrixXd::NullaryExpr(dimension * rows, dimension * rows, [&] { return uniform(random); });
  if (symmetric) full = (full + full.transpose()).eval();
  full.diagonal().array() += shift;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::int64_t b = K.row_first[r]; b < K.row_first[r + 1]; ++b)
      for (int a = 0; a < dimension; ++a)
        for (int c = 0; c < dimension; ++c) {
          K.values.push_back(
              full(static_cast<Eigen::Index>(dimension * r) + a, dimension * K.column[static_cast<std::size_t>(b)] + c));
        }
  return K;
}

/// Every component is free but the first point and one component of the eighth.
Field free_components(const BlockMatrix& K) {
  Field free(dimension, stride);
  for (const std::int32_t p : K.point)
    for (int c = 0; c < dimension; ++c) free.component(c)[p] = 1.0;
  for (int c = 0; c < dimension; ++c) free.component(c)[K.point[0]] = 0.0;
  free.component(1)[K.point[8]] = 0.0;
  return free;
}

/// |b - K x| on free components; the product straight from the blocks.
double misfit(const BlockMatrix& K, const Field& free, const Field& x, const Field& b) {
  double most = 0;
  for (std::size_t r = 0; r < rows; ++r)
    for (int a = 0; a < dimension; ++a) {
      if (free.component(a)[K.point[r]] == 0) continue;
      double sum = b.component(a)[K.point[r]];
      for (std::int64_t block = K.row_first[r]; block < K.row_first[r + 1]; ++block)
        for (int c = 0; c < dimension; ++c) {
          sum -= K.values[static_cast<std::size_t>((block * dimension + a) * dimension + c)] *
                 x.component(c)[K.point[static_cast<std::size_t>(K.column[static_cast<std::size_t>(block)])]];
        }
      most = std::max(most, std::abs(sum));
    }
  return most;
}

Field right_side() {
  Field b(dimension, stride);
  for (std::size_t k = 0; k < b.size(); ++k) b.data()[k] = std::sin(1.0 + static_cast<double>(k));
  return b;
}

}  // namespace

TEST_CASE("sparse solver: the free part of definite, indefinite and unsymmetric matrices is solved") {
  struct Kind {
    bool symmetric;
    double shift;
    bool definite;
  };
  for (const Kind kind : {Kind{true, 20.0, true}, Kind{true, 0.3, false}, Kind{false, 6.0, false}}) {
    CAPTURE(kind.symmetric);
    CAPTURE(kind.shift);
    SparseSolver solver;
    const Field b = right_side();
    Field x(dimension, stride);
    for (const unsigned seed : {1u, 2u}) {  // the second factorisation reuses the analysis
      const BlockMatrix K = banded(kind.symmetric, kind.shift, seed);
      const Field free = free_components(K);
      std::string failure;
      REQUIRE_MESSAGE(solver.factorise(K, free, failure), failure);
      CHECK(solver.positive_definite() == kind.definite);
      CHECK(solver.unknowns() == dimension * rows - 3);
      solver.solve(b, x);
      CHECK(misfit(K, free, x, b) < 1e-11);
      for (std::size_t k = 0; k < x.size(); ++k) {
        if (free.data()[k] == 0) CHECK(x.data()[k] == 0.0);
      }
    }
  }
}

TEST_CASE("sparse solver: an indefinite matrix between definite ones changes nothing of theirs") {
  SparseSolver solver;
  const BlockMatrix definite = banded(true, 20.0, 3), indefinite = banded(true, 0.3, 3);
  const Field free = free_components(definite), b = right_side();
  std::string failure;
  Field before(dimension, stride), after(dimension, stride);
  REQUIRE(solver.factorise(definite, free, failure));
  solver.solve(b, before);
  REQUIRE(solver.factorise(indefinite, free, failure));
  REQUIRE(solver.factorise(definite, free, failure));
  solver.solve(b, after);
  for (std::size_t k = 0; k < b.size(); ++k) CHECK(before.data()[k] == after.data()[k]);
}

TEST_CASE("sparse solver: threads do not change a bit") {
  const int threads = thread_count();
  const BlockMatrix K = banded(false, 6.0, 5);
  const Field free = free_components(K), b = right_side();
  Field one(dimension, stride), two(dimension, stride);
  std::string failure;
  for (const int n : {1, 2}) {
    set_thread_count(n);
    SparseSolver solver;
    REQUIRE(solver.factorise(K, free, failure));
    solver.solve(b, n == 1 ? one : two);
  }
  set_thread_count(threads);
  for (std::size_t k = 0; k < b.size(); ++k) CHECK(one.data()[k] == two.data()[k]);
}

TEST_CASE("sparse solver: a singular matrix is refused with its reason") {
  BlockMatrix K = banded(true, 20.0, 7);
  for (std::size_t k = 0; k < K.values.size(); ++k) K.values[k] = 0.0;
  SparseSolver solver;
  std::string failure;
  CHECK(!solver.factorise(K, free_components(K), failure));
  CHECK(failure == "the tangent is singular: part of the body is free to move");
  CHECK(!solver.factorised());
}

TEST_CASE("sparse solver: a factor that memory cannot hold is refused with both numbers, and nothing is factorised") {
  const BlockMatrix K = banded(true, 20.0, 7);
  const Field free = free_components(K);
  std::string failure;
  SparseSolver roomy(1e6);
  REQUIRE(roomy.factorise(K, free, failure));
  SparseSolver solver(1000);  // bytes; 77 unknowns with a band of eight need some 5000
  CHECK(!solver.factorise(K, free, failure));
  CHECK(failure.starts_with("the Cholesky factor of 77 unknowns needs "));
  CHECK(failure.ends_with(" GB; this machine offers 1e-06 GB"));
  CHECK(!solver.factorised());
}
