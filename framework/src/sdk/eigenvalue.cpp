#include "perikit/sdk/eigenvalue.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"

namespace perikit {

namespace {

struct RitzValue {
  double value, residual;
};

/// The largest eigenvalue of the tridiagonal matrix with this diagonal and these entries beside it, and the bound of its residual.
RitzValue largest_ritz_value(const std::vector<double>& alpha, const std::vector<double>& beta, double next) {
  const auto order = static_cast<Eigen::Index>(alpha.size());
  const Eigen::Map<const Eigen::VectorXd> diagonal(alpha.data(), order), off(beta.data(), order - 1);
  // The solver compares squares of the entries beside the diagonal with entries on it: both are to be of order 1.
  double largest = 0;
  for (const double entry : alpha) largest = std::max(largest, std::abs(entry));
  const double unit = power_of_two(largest);
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
  ritz.computeFromTridiagonal(diagonal / unit, off / unit);
  return {unit * ritz.eigenvalues()(order - 1), next * std::abs(ritz.eigenvectors()(order - 1, order - 1))};
}

}  // namespace

EigenvalueBounds eigenvalue_bounds(Problem& problem, ConstFieldView u, ConstFieldView scale, FieldView vector, bool warm, double enough, const GoesOn& goes_on) {
  const std::size_t n = scale.size();
  const int d = problem.dimension();
  Field last = problem.make_field(), w = problem.make_field(), Kw = problem.make_field();
  FieldView q = vector, before = last;
  Field start;   // of an estimate that may be given up
  if (goes_on && warm) {
    start = problem.make_field();
    copy(vector, start);
  }
  if (!warm) {
    fill_with_noise(scale, 1, problem.points().places(), vector);
  } else {
    // A little noise: a symmetric eigenvector must not hide a growing one of another symmetry.
    const double size =
        norm(vector) / std::sqrt(static_cast<double>(problem.points().size_on_all_ranks() * static_cast<std::size_t>(d)));
    fill_with_noise(scale, 1, problem.points().places(), w);
    combine(1, vector, 0.05 * size, w, vector);
  }
  const double size = norm(vector);
  if (!(size > 0)) return {};  // nothing is free
  for (std::size_t k = 0; k < n; ++k) q.data[k] /= size;
  std::vector<double> alpha, beta;
  const int most = 80;
  EigenvalueBounds found;
  for (int k = 0; k < most; ++k) {
    if (goes_on && !goes_on()) {
      if (warm) copy(start, vector);
      else fill(0.0, vector);
      return {.given_up = true};
    }
    for (std::size_t i = 0; i < n; ++i) w.data()[i] = scale.data[i] * q.data[i];
    if (!problem.tangent_action({u, problem.state().time}, w, Kw).ok()) return {};
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] *= scale.data[i];
    alpha.push_back(dot(Kw, q));
    const double b = beta.empty() ? 0.0 : beta.back();
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] -= alpha.back() * q.data[i] + b * before.data[i];
    const double next = norm(Kw);
    const auto [value, residual] = largest_ritz_value(alpha, beta, next);
    found = {value, value + residual};
    const bool converged = k >= (warm ? 5 : 12) && residual <= 0.02 * value, below = warm && k >= 2 && residual <= 0.1 * value && found.bound < enough;
    if (below || converged || k + 1 == most || next <= 1e-14 * std::abs(value)) break;
    beta.push_back(next);
    std::swap(before, q);
    for (std::size_t i = 0; i < n; ++i) q.data[i] = Kw.data()[i] / next;
  }
  // The last Lanczos vector is rich in the top of the spectrum: a good start for the next call.
  if (q.data != vector.data) copy(q, vector);
  return found;
}

double largest_eigenvalue(Problem& problem, ConstFieldView u, ConstFieldView scale, FieldView vector, bool warm, const GoesOn& goes_on) {
  return eigenvalue_bounds(problem, u, scale, vector, warm, 0, goes_on).bound;
}

double largest_eigenvalue(Problem& problem, DamagedPart& part, ConstFieldView u, ConstFieldView scale, double enough) {
  // Parts are small: vectors hold their entries alone.
  Field w = problem.make_field(), Kw = problem.make_field();
  fill_with_noise(part.inside(), 1, problem.points().places(), w);
  std::vector<std::size_t> entries;
  for (std::size_t k = 0; k < w.size(); ++k)
    if (w.data()[k] != 0 && scale.data[k] != 0) entries.push_back(k);
    else w.data()[k] = 0;
  const std::size_t n = entries.size();
  std::vector<double> q(n), before(n), Kq(n), alpha, beta;
  const auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {
    return total_over_ranks(exact_sum(n, [&](std::size_t k) { return a[k] * b[k]; }));
  };
  for (std::size_t k = 0; k < n; ++k) q[k] = w.data()[entries[k]];
  const double size = std::sqrt(product(q, q));
  if (!(size > 0)) return 0;   // nothing is free
  for (double& value : q) value /= size;
  constexpr int most = 80;
  for (int step = 0;; ++step) {
    for (std::size_t k = 0; k < n; ++k) w.data()[entries[k]] = scale.data[entries[k]] * q[k];
    if (!part.tangent_action({u, problem.state().time}, w, Kw).ok()) return 0;
    for (std::size_t k = 0; k < n; ++k) Kq[k] = scale.data[entries[k]] * Kw.data()[entries[k]];
    alpha.push_back(product(Kq, q));
    const double b = beta.empty() ? 0.0 : beta.back();
    for (std::size_t k = 0; k < n; ++k) Kq[k] -= alpha.back() * q[k] + b * before[k];
    const double next = std::sqrt(product(Kq, Kq));
    const auto [value, residual] = largest_ritz_value(alpha, beta, next);
    const bool converged = step >= 12 && residual <= 0.02 * value, below = step >= 2 && value + residual < enough;
    if (below || converged || step + 1 == most || next <= 1e-14 * std::abs(value)) return value + residual;
    beta.push_back(next);
    std::swap(before, q);
    for (std::size_t k = 0; k < n; ++k) q[k] = Kq[k] / next;
  }
}

}  // namespace perikit
