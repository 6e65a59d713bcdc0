#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>

#include "perikit/body/lattice.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

namespace {

/// Sums over fields in fixed blocks, the same for any number of threads.
double dot(ConstFieldView a, ConstFieldView b) {
  constexpr std::size_t block = 16384;
  const std::size_t n = a.size();
  return ordered_sum((n + block - 1) / block, [&](std::size_t i) {
    double sum = 0;
    for (std::size_t k = i * block; k < std::min(n, (i + 1) * block); ++k) sum += a.data[k] * b.data[k];
    return sum;
  });
}

/// Uniform in [-1, 1), a hash of the index.
double noise(std::uint64_t k) {
  k = (k ^ (k >> 30)) * 0xbf58476d1ce4e5b9ULL;
  k = (k ^ (k >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((k ^ (k >> 31)) >> 11) * 0x1.0p-52 - 1.0;
}

}  // namespace

double BodyProblem::largest_eigenvalue(ConstFieldView u) {
  const auto masses = mass();
  const ConstFieldView free = free_mask();
  const std::size_t n = free.size();
  // Lanczos on M^-1/2 K M^-1/2 restricted to the free components.
  AlignedVector<double> scale(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double m = masses[k % stride()];
    scale[k] = m > 0 ? free.data[k] / std::sqrt(m) : 0.0;
  }
  Field q = body_.make_field(dimension()), before = body_.make_field(dimension()), w = body_.make_field(dimension()), Kw = body_.make_field(dimension());
  const bool warm = eigenvector_.size() > 0;
  if (!warm) {
    eigenvector_ = body_.make_field(dimension());
    for (std::size_t k = 0; k < n; ++k) eigenvector_.data()[k] = scale[k] > 0 ? noise(k + 1) : 0.0;
  } else {
    // A little noise: a symmetric eigenvector must not hide a growing one of another symmetry.
    const double size = std::sqrt(dot(eigenvector_, eigenvector_) / static_cast<double>(points() * static_cast<std::size_t>(dimension())));
    for (std::size_t k = 0; k < n; ++k) eigenvector_.data()[k] += scale[k] > 0 ? 0.05 * size * noise(k + 1) : 0.0;
  }
  const double norm = std::sqrt(dot(eigenvector_, eigenvector_));
  if (!(norm > 0)) return 0.0;   // nothing is free
  for (std::size_t k = 0; k < n; ++k) q.data()[k] = eigenvector_.data()[k] / norm;
  std::vector<double> alpha, beta;
  const int most = 80;
  double bound = 0;
  for (int k = 0; k < most; ++k) {
    for (std::size_t i = 0; i < n; ++i) w.data()[i] = scale[i] * q.data()[i];
    if (!tangent_action(u, w, Kw).ok()) return 0.0;
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] *= scale[i];
    alpha.push_back(dot(Kw, q));
    const double b = beta.empty() ? 0.0 : beta.back();
    for (std::size_t i = 0; i < n; ++i) Kw.data()[i] -= alpha.back() * q.data()[i] + b * before.data()[i];
    const double next = std::sqrt(dot(Kw, Kw));
    // Largest Ritz value and its residual bound.
    const auto size = static_cast<Eigen::Index>(alpha.size());
    Eigen::VectorXd diagonal = Eigen::Map<Eigen::VectorXd>(alpha.data(), size);
    Eigen::VectorXd off = size > 1 ? Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(beta.data(), size - 1)) : Eigen::VectorXd(0);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
    ritz.computeFromTridiagonal(diagonal, off);
    const double value = ritz.eigenvalues()(size - 1);
    const double residual = next * std::abs(ritz.eigenvectors()(size - 1, size - 1));
    bound = value + residual;
    const bool converged = k >= (warm ? 5 : 12) && residual <= 0.02 * value;
    if (converged || k + 1 == most || next <= 1e-14 * std::abs(value)) break;
    beta.push_back(next);
    std::swap(before, q);
    for (std::size_t i = 0; i < n; ++i) q.data()[i] = Kw.data()[i] / next;
  }
  // The last Lanczos vector is rich in the top of the spectrum: a good start for the next call.
  std::copy_n(q.data(), n, eigenvector_.data());
  return bound;
}

double BodyProblem::bond_based_time_step() const {
  // P 3.58 for a whole family: dt = sqrt(2 rho / sum_j V_j C / |xi|), on a lattice of the mean spacing.
  const int d = dimension();
  const double delta = body_.horizon(), dx = body_.spacing(), section = body_.section();
  const double reach = 2 * std::ceil(delta / dx) * dx;
  const Lattice lattice = make_lattice(d, dx, {}, {reach + dx, reach + dx, reach + dx}, delta);
  double sum = 0;
  for (const auto& offset : family_offsets(lattice, delta)) {
    sum += std::pow(dx, d) * section / (dx * std::sqrt(double(offset[0]) * offset[0] + double(offset[1]) * offset[1] + double(offset[2]) * offset[2]));
  }
  double least = 0;
  for (const std::int32_t index : body_.internal()) {
    const auto p = static_cast<std::size_t>(index);
    const Moduli moduli = laws_->moduli(p);
    const double pi = std::numbers::pi, nu = moduli.poisson(), K = moduli.bulk();
    const double plane = body_.space() == Space::plane_stress ? moduli.youngs() / (2 * (1 - nu)) : K + moduli.mu / 3;
    const double C = d == 3 ? 18 * K / (pi * std::pow(delta, 4))
                   : d == 2 ? 12 * plane / (pi * section * std::pow(delta, 3)) : 2 * moduli.youngs() / (section * delta * delta);
    const double dt = std::sqrt(2 * laws_->density(p) / (C * sum));
    least = least > 0 ? std::min(least, dt) : dt;
    if (laws_->single() && laws_->record_of(p).densities.empty()) break;
  }
  return least;
}

}  // namespace perikit
