#include "multigrid.hpp"

// Eigen's kernels for AVX-512 begin with registers that the compiler's own header leaves undefined on purpose, which g++ 12 takes for forgotten values.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <Eigen/Dense>
#include <Eigen/Sparse>
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
#include <algorithm>
#include <cmath>

#include "perikit/core/parallel.hpp"
#include "work_apart.hpp"

namespace perikit {

namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;
using Modes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  ///< of unknowns, a column a motion

constexpr int degree = 2;                  // of the smoothing polynomial
constexpr double smoothed_part = 1.0 / 8;  // eigenvalues of D^-1 K from this part of the largest one on are smoothed
constexpr Eigen::Index direct = 400;       // unknowns that a dense factorisation takes
constexpr int most_levels = 12;

/// y <- A x by rows, on all threads.
void multiply(const Matrix& A, const Vector& x, Vector& y) {
  constexpr Eigen::Index block = 2048;
  y.resize(A.rows());
  parallel_for(static_cast<std::size_t>((A.rows() + block - 1) / block), [&](std::size_t b) {
    const Eigen::Index begin = static_cast<Eigen::Index>(b) * block, end = std::min(A.rows(), begin + block);
    const auto* first = A.outerIndexPtr();
    for (Eigen::Index row = begin; row < end; ++row) {
      double sum = 0;
      for (auto k = first[row]; k < first[row + 1]; ++k) sum += A.valuePtr()[k] * x[A.innerIndexPtr()[k]];
      y[row] = sum;
    }
  });
}

/// Which aggregate each node belongs to: nodes with all their neighbours, where none of these belongs to another one yet; what is
/// left joins a neighbour's aggregate, or makes one of its own.
std::vector<int> aggregate(const std::vector<std::vector<int>>& neighbours, int& count) {
  std::vector<int> of(neighbours.size(), -1);
  count = 0;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (of[i] >= 0 || std::ranges::any_of(neighbours[i], [&](int j) { return of[static_cast<std::size_t>(j)] >= 0; })) continue;
    of[i] = count;
    for (const int j : neighbours[i]) of[static_cast<std::size_t>(j)] = count;
    ++count;
  }
  const std::vector<int> roots = of;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (of[i] >= 0) continue;
    for (const int j : neighbours[i])
      if (roots[static_cast<std::size_t>(j)] >= 0) of[i] = roots[static_cast<std::size_t>(j)];
    if (of[i] >= 0) continue;
    of[i] = count;
    for (const int j : neighbours[i])
      if (of[static_cast<std::size_t>(j)] < 0) of[static_cast<std::size_t>(j)] = count;
    ++count;
  }
  return of;
}

/// Unknowns of one level belong to nodes: points, or aggregates of the level before.
struct Nodes {
  std::vector<int> of;                       ///< node of each unknown
  std::vector<std::vector<int>> neighbours;  ///< of each node, without itself
};

/// Nodes that share an entry of A.
void connect(const Matrix& A, Nodes& nodes, int count) {
  nodes.neighbours.assign(static_cast<std::size_t>(count), {});
  for (Eigen::Index row = 0; row < A.rows(); ++row) {
    const int i = nodes.of[static_cast<std::size_t>(row)];
    for (Matrix::InnerIterator entry(A, row); entry; ++entry) {
      const int j = nodes.of[static_cast<std::size_t>(entry.col())];
      if (j != i) nodes.neighbours[static_cast<std::size_t>(i)].push_back(j);
    }
  }
  for (auto& list : nodes.neighbours) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

/// Orthonormal coarse functions of each aggregate that span the modes there, and the modes in terms of them. A motion that an
/// aggregate cannot tell from the others (a single point cannot rotate) leaves a function of zeros.
Matrix tentative(const Modes& modes, const std::vector<std::vector<int>>& members, Modes& coarse) {
  const Eigen::Index m = modes.cols(), count = static_cast<Eigen::Index>(members.size());
  coarse.setZero(count * m, m);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index a = 0; a < count; ++a) {
    const auto& own = members[static_cast<std::size_t>(a)];
    Eigen::MatrixXd Q(own.size(), m);
    for (std::size_t k = 0; k < own.size(); ++k) Q.row(static_cast<Eigen::Index>(k)) = modes.row(own[k]);
    for (Eigen::Index c = 0; c < m; ++c) {
      const double size = Q.col(c).norm();
      for (int pass = 0; pass < 2; ++pass)  // twice is enough
        for (Eigen::Index e = 0; e < c; ++e) {
          const double along = Q.col(e).dot(Q.col(c));
          coarse(a * m + e, c) += along;
          Q.col(c) -= along * Q.col(e);
        }
      const double left = Q.col(c).norm();
      if (left <= 1e-6 * size) {
        Q.col(c).setZero();
        continue;
      }
      coarse(a * m + c, c) = left;
      Q.col(c) /= left;
      for (std::size_t k = 0; k < own.size(); ++k) entries.emplace_back(own[k], a * m + c, Q(static_cast<Eigen::Index>(k), c));
    }
  }
  Matrix P(modes.rows(), count * m);
  P.setFromTriplets(entries.begin(), entries.end());
  return P;
}

struct Level {
  Matrix A, P, restriction;  ///< restriction: the transpose of P, by rows
  Vector inverse_diagonal;
  double largest = 1;  ///< an upper estimate of the eigenvalues of D^-1 A
  Vector x, b, r, step, work;

  explicit Level(Matrix matrix) : A(std::move(matrix)), inverse_diagonal(A.rows()) {
    for (Eigen::Index k = 0; k < A.rows(); ++k) inverse_diagonal[k] = 1 / A.coeff(k, k);
    // Power iteration from a rough, reproducible vector.
    x.resize(A.rows());
    for (Eigen::Index k = 0; k < A.rows(); ++k)
      x[k] = std::sin(1.0 + 7.0 * static_cast<double>(k % 1009) + 0.1 * static_cast<double>(k));
    for (int round = 0; round < 12; ++round) {
      x /= x.norm();
      multiply(A, x, r);
      x = r.cwiseProduct(inverse_diagonal);
      largest = 1.15 * x.norm();
    }
  }

  /// x <- x + p(D^-1 A) D^-1 (b - A x); from x = 0 where `fresh`.
  void smooth(bool fresh) {
    const double upper = largest, lower = smoothed_part * largest, centre = (upper + lower) / 2, half = (upper - lower) / 2;
    if (fresh) {
      r = b;
      x.setZero(A.rows());
    } else {
      multiply(A, x, work);
      r = b - work;
    }
    double rho = half / centre;
    step = r.cwiseProduct(inverse_diagonal) / centre;
    for (int k = 1;; ++k) {
      x += step;
      if (k == degree) break;
      multiply(A, step, work);
      r -= work;
      const double next = 1 / (2 * centre / half - rho);
      step = next * rho * step + (2 * next / half) * r.cwiseProduct(inverse_diagonal);
      rho = next;
    }
  }
};

}  // namespace

struct Multigrid::Implementation {
  FreeMatrix free;
  std::vector<Level> levels;
  Eigen::LDLT<Eigen::MatrixXd> coarsest;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> sparse_coarsest;  ///< where aggregates stop growing early
  bool dense = true;
  std::function<bool()> goes_on;
  bool given_up = false;   // a thread is still at work on it

  Matrix finest(const BlockMatrix& K) {
    std::vector<FreeMatrix::Index> first, row;
    std::vector<double> value;
    free.pattern(K, false, first, row);
    free.values(K, false, first, value);
    const auto n = static_cast<Eigen::Index>(free.unknowns());
    // Columns of a symmetric matrix are its rows.
    return Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor, FreeMatrix::Index>>(
        n, n, static_cast<Eigen::Index>(value.size()), first.data(), row.data(), value.data());
  }

  /// Modes and nodes of the coarser level; false where it would hardly be smaller.
  bool coarsen(Level& fine, Modes& modes, Nodes& nodes) {
    int count = 0;
    const std::vector<int> of = aggregate(nodes.neighbours, count);
    const Eigen::Index m = modes.cols();
    if (count * m > 0.7 * static_cast<double>(fine.A.rows())) return false;
    std::vector<std::vector<int>> members(static_cast<std::size_t>(count));
    for (Eigen::Index k = 0; k < fine.A.rows(); ++k)
      members[static_cast<std::size_t>(of[static_cast<std::size_t>(nodes.of[static_cast<std::size_t>(k)])])].push_back(
          static_cast<int>(k));
    Modes coarse;
    const Matrix rough = tentative(modes, members, coarse);
    // One step of damped Jacobi makes the coarse functions smooth.
    const Vector scale = (4.0 / 3 / fine.largest) * fine.inverse_diagonal;
    fine.P = rough - Matrix(scale.asDiagonal() * Matrix(fine.A * rough));
    fine.restriction = fine.P.transpose();
    Matrix A = fine.restriction * Matrix(fine.A * fine.P);
    for (Eigen::Index k = 0; k < A.rows(); ++k)
      if (!(A.coeff(k, k) > 0)) A.coeffRef(k, k) = 1;  // of a function of zeros
    A.makeCompressed();
    nodes.of.resize(static_cast<std::size_t>(A.rows()));
    for (std::size_t k = 0; k < nodes.of.size(); ++k) nodes.of[k] = static_cast<int>(static_cast<Eigen::Index>(k) / m);
    connect(A, nodes, count);
    modes = std::move(coarse);
    levels.emplace_back(std::move(A));
    return true;
  }

  void make_levels(Matrix K, Modes& modes, Nodes& nodes, int count) {
    levels.reserve(most_levels);
    levels.emplace_back(std::move(K));
    connect(levels.back().A, nodes, count);
    while (levels.size() < most_levels && levels.back().A.rows() > direct && coarsen(levels.back(), modes, nodes)) continue;
    const Matrix& last = levels.back().A;
    dense = last.rows() <= 4 * direct;
    if (dense)
      coarsest.compute(Eigen::MatrixXd(last));
    else
      sparse_coarsest.compute(Eigen::SparseMatrix<double>(last));
  }

  void cycle(std::size_t l) {
    Level& level = levels[l];
    if (l + 1 == levels.size()) {
      level.x = dense ? Vector(coarsest.solve(level.b)) : Vector(sparse_coarsest.solve(level.b));
      return;
    }
    level.smooth(true);
    multiply(level.A, level.x, level.work);
    level.r = level.b - level.work;
    multiply(level.restriction, level.r, levels[l + 1].b);
    cycle(l + 1);
    multiply(level.P, levels[l + 1].x, level.work);
    level.x += level.work;
    level.smooth(false);
  }
};

Multigrid::Multigrid() : implementation_(std::make_unique<Implementation>()) {}
Multigrid::~Multigrid() {
  if (implementation_ && implementation_->given_up) implementation_.release();
}
Multigrid::Multigrid(Multigrid&&) noexcept = default;
Multigrid& Multigrid::operator=(Multigrid&&) noexcept = default;

void Multigrid::watch(std::function<bool()> goes_on) { implementation_->goes_on = std::move(goes_on); }

void Multigrid::make(const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid) {
  Implementation& own = *implementation_;
  own.levels.clear();
  own.free = FreeMatrix(K, free);
  if (own.free.unknowns() == 0) return;
  const auto n = static_cast<Eigen::Index>(own.free.unknowns());
  Modes modes(n, static_cast<Eigen::Index>(rigid.size()));
  for (Eigen::Index k = 0; k < n; ++k)
    for (std::size_t c = 0; c < rigid.size(); ++c)
      modes(k, static_cast<Eigen::Index>(c)) = rigid[c].data()[own.free.place(static_cast<std::size_t>(k))];
  Nodes nodes;
  int count = 0;
  for (std::size_t r = 0; r < K.rows(); ++r) {
    bool any = false;
    for (int a = 0; a < K.dimension; ++a)
      if (own.free.unknown(r, a) >= 0) nodes.of.push_back(count), any = true;
    count += any;
  }
  struct Work {
    Matrix K;
    Modes modes;
    Nodes nodes;
    int count;
  };
  const auto work = std::make_shared<Work>(Work{own.finest(K), std::move(modes), std::move(nodes), count});
  own.given_up = !work_apart(own.goes_on, [&own, work] { own.make_levels(std::move(work->K), work->modes, work->nodes, work->count); });
}

void Multigrid::apply(ConstFieldView r, FieldView z) {
  Implementation& own = *implementation_;
  const std::size_t n = own.free.unknowns();
  if (n > 0) {
    Level& top = own.levels.front();
    top.b.resize(static_cast<Eigen::Index>(n));
    for (std::size_t k = 0; k < n; ++k) top.b[static_cast<Eigen::Index>(k)] = r.data[own.free.place(k)];
    own.cycle(0);
  }
  std::fill_n(z.data, z.size(), 0.0);
  for (std::size_t k = 0; k < n; ++k) z.data[own.free.place(k)] = own.levels.front().x[static_cast<Eigen::Index>(k)];
}

}  // namespace perikit
