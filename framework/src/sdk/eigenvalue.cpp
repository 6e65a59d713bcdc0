#include "perikit/sdk/eigenvalue.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

/// action(w, Kw): Kw <- K w; false where u is inadmissible.
template <class Action>
double lanczos(Problem& problem, Action&& action, ConstFieldView scale, FieldView vector, bool warm) {
  const std::size_t n = scale.size();
  const int d = problem.dimension();
  Field last = problem.make_field(), w = problem.make_field(), Kw = problem.make_field();
  FieldView q = vector, before = last;
  if (!warm) {
    fill_with_noise(scale, 1, problem.body().places(), vector);
  } else {
    // A little noise: a symmetric eigenvector must not hide a growing one of another symmetry.
    const double size =
        norm(vector) / std::sqrt(static_cast<double>(problem.body().points_of_all_ranks() * static_cast<std::size_t>(d)));
    fill_with_noise(scale, 1, problem.body().places(), w);
    combine(1, vector, 0.05 * size, w, vector);
  }
  const double size = norm(vector);
  if (!(size > 0)) return 0.0;  // nothing is free
  for (std::size_t k = 0; k < n; ++k) q.data[k] /= size;
  std::vector<double> alpha, beta;
  const int most = 80;
  double bound = 0;
  for (int k = 0; k < most; ++k) {
    for (std::size_t i = 0; i < n; ++i) w.data()[i] = scale.data[i] * q.data[i];
    if (!action(w, Kw)) return 0.0;
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] *= scale.data[i];
    alpha.push_back(dot(Kw, q));
    const double b = beta.empty() ? 0.0 : beta.back();
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] -= alpha.back() * q.data[i] + b * before.data[i];
    const double next = norm(Kw);
    // Largest Ritz value and its residual bound.
    const auto order = static_cast<Eigen::Index>(alpha.size());
    Eigen::VectorXd diagonal = Eigen::Map<Eigen::VectorXd>(alpha.data(), order);
    Eigen::VectorXd off = order > 1 ? Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(beta.data(), order - 1)) : Eigen::VectorXd(0);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
    ritz.computeFromTridiagonal(diagonal, off);
    const double value = ritz.eigenvalues()(order - 1);
    const double residual = next * std::abs(ritz.eigenvectors()(order - 1, order - 1));
    bound = value + residual;
    const bool converged = k >= (warm ? 5 : 12) && residual <= 0.02 * value;
    if (converged || k + 1 == most || next <= 1e-14 * std::abs(value)) break;
    beta.push_back(next);
    std::swap(before, q);
    for (std::size_t i = 0; i < n; ++i) q.data[i] = Kw.data()[i] / next;
  }
  // The last Lanczos vector is rich in the top of the spectrum: a good start for the next call.
  if (q.data != vector.data) copy(q, vector);
  return bound;
}

}  // namespace

double largest_eigenvalue(Problem& problem, ConstFieldView u, ConstFieldView scale, FieldView vector, bool warm) {
  return lanczos(problem, [&](ConstFieldView w, FieldView Kw) { return problem.tangent_action(u, w, Kw).ok(); }, scale, vector, warm);
}

double largest_eigenvalue(Problem& problem, DamagedPart& part, ConstFieldView u, ConstFieldView scale) {
  Field of_part = problem.make_field(), vector = problem.make_field();
  copy(scale, of_part);
  mask(part.inside(), of_part);
  return lanczos(problem, [&](ConstFieldView w, FieldView Kw) { return part.tangent_action(u, w, Kw).ok(); }, of_part, vector, false);
}

}  // namespace perikit
