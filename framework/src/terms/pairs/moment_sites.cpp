#include "terms/pairs/moment_sites.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

constexpr int most_steps = 8, most_rounds = 20, most_products = 100;
/// Unknowns of a small system.
constexpr std::size_t most_at_once = 700;
/// Moments with errors below this have what was asked for.
constexpr double moment_rounding = 1e-13;

}  // namespace

template <int D>
MomentSites<D>::MomentSites(std::span<const std::array<double, D>> directions) {
  for (const std::array<double, D>& direction : directions) {
    double n[D], phi[moments];
    std::copy(direction.begin(), direction.end(), n);
    even_polynomials<D>(n, phi);
    phi_.push_back(Eigen::Map<const Moments>(phi));
  }
}

template <int D>
void MomentSites<D>::add(std::span<const Link> links, double count) {
  count_.push_back(count);
  links_.insert(links_.end(), links.begin(), links.end());
  first_.push_back(links_.size());
}

template <int D>
double MomentSites<D>::factor(std::size_t site, std::size_t own_slot, std::size_t far, std::size_t far_slot) const noexcept {
  // The two products first: the sum is the same from both ends.
  const double own = lambda_[site].dot(phi_[own_slot]), other = lambda_[far].dot(phi_[far_slot]);
  return std::max(least_factor, 1 + (own + other));
}

/// Half of sum_b w_b H(y_b), H' = max(floor, 1 + y), for bonds whose other half the other end has; less what is asked for.
template <int D>
double MomentSites<D>::merit(std::size_t site) const {
  double sum = -lambda_[site][0];
  for (std::size_t k = first_[site]; k < first_[site + 1]; ++k) {
    const Link& link = links_[k];
    const double own = lambda_[site].dot(phi_[link.own_slot]);
    if (link.fixed > 0) {
      sum += link.weight * link.fixed * own;
      continue;
    }
    const double y = own + lambda_[static_cast<std::size_t>(link.far)].dot(phi_[link.far_slot]);
    sum += 0.5 * link.weight * (1 + y > least_factor ? y + 0.5 * y * y : least_factor * y - 0.5 * (1 - least_factor) * (1 - least_factor));
  }
  return sum;
}

template <int D>
auto MomentSites<D>::residual(std::size_t site) const -> Moments {
  Moments sum = Moments::Zero();
  for (std::size_t k = first_[site]; k < first_[site + 1]; ++k) {
    const Link& link = links_[k];
    const double f = link.fixed > 0 ? link.fixed : factor(site, link.own_slot, static_cast<std::size_t>(link.far), link.far_slot);
    sum += link.weight * f * phi_[link.own_slot];
  }
  sum[0] -= 1;
  return sum;
}

/// Method of multipliers around Newton's method: R(lambda) + shift S (lambda - lambda_0) = 0, S the curvatures of all factors that are to be found, then lambda_0 <- lambda. After the first step,
/// of a large shift, sites that cannot have their moments stay with that shift and lambda_0 = 0. A large system is solved roughly, by stabilised biconjugate gradients, and for the first step alone.
template <int D>
void MomentSites<D>::solve() {
  const std::size_t n = size();
  const bool small = n * moments <= most_at_once;
  lambda_.assign(n, Moments::Zero());
  error_.assign(n, 0.0);
  std::vector<Moments> scale(n), curvature(n), centre(n, Moments::Zero()), rest(n), before(n), step(n);
  std::vector<std::uint8_t> free(links_.size(), 0), found(n), held(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    scale[k] = Moments::Constant(1e-300);
    for (std::size_t b = first_[k]; b < first_[k + 1]; ++b)
      if (links_[b].fixed == 0) scale[k] += links_[b].weight * phi_[links_[b].own_slot].cwiseAbs2();
    // A polynomial that vanishes along all these bonds has none, nor has a site with nothing to find.
    found[k] = scale[k][0] > 1e-200;
    curvature[k] = found[k] ? Moments(scale[k].array() + 1e-2 * scale[k].maxCoeff()) : Moments::Ones();
    scale[k] = first_multiplier_shift * curvature[k];
  }
  const auto over_sites = [&](auto body) { parallel_for(n, body); };
  // rest <- R + shift S (lambda - lambda_0), and the convex function that this is the derivative of.
  std::vector<double> merits(n);
  const auto evaluate = [&] {
    over_sites([&](std::size_t k) {
      const Moments moved = lambda_[k] - centre[k];
      rest[k] = found[k] ? Moments(residual(k) + scale[k].cwiseProduct(moved)) : Moments::Zero();
      merits[k] = found[k] ? count_[k] * (merit(k) + 0.5 * moved.dot(scale[k].cwiseProduct(moved))) : 0.0;
    });
    return std::accumulate(merits.begin(), merits.end(), 0.0);
  };
  for (int outer = 0; outer < (small ? most_steps : 1); ++outer) {
    double value = evaluate(), last = std::numeric_limits<double>::infinity();
    for (int round = 0; round < most_rounds; ++round) {
      double error = 0;
      for (const Moments& r : rest) error = std::max(error, r.cwiseAbs().maxCoeff());
      if (error <= (small ? 0.5 * moment_rounding : 1e-5) || (error <= 1e-9 && error > 0.5 * last)) break;
      last = error;
      over_sites([&](std::size_t k) {
        for (std::size_t b = first_[k]; b < first_[k + 1]; ++b) {
          const Link& link = links_[b];
          free[b] = link.fixed == 0 && factor(k, link.own_slot, static_cast<std::size_t>(link.far), link.far_slot) > least_factor;
        }
      });
      if (small) solve_at_once(free, scale, rest, step);
      else solve_roughly(free, scale, rest, 0.1 * error, step);
      before = lambda_;
      double slope = 0, length = 1, after = 0;
      for (std::size_t k = 0; k < n; ++k) slope += count_[k] * rest[k].dot(step[k]);
      for (int halving = 0; halving < 12; ++halving, length *= 0.5) {
        for (std::size_t k = 0; k < n; ++k) lambda_[k] = before[k] - length * step[k];
        after = evaluate();
        if (after <= value - 1e-4 * length * slope + 1e-14 * std::abs(value)) break;
      }
      value = after;
    }
    over_sites([&](std::size_t k) {
      rest[k] = residual(k);
      error_[k] = rest[k].cwiseAbs().maxCoeff();
    });
    double left = 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (found[k] && error_[k] > (outer == 0 ? first_allowed : later_allowed)) held[k] = 1;
      if (held[k]) {
        centre[k].setZero();
        scale[k] = first_multiplier_shift * curvature[k];
        continue;
      }
      left = std::max(left, error_[k]);
      centre[k] = lambda_[k];
      if (found[k]) scale[k] = later_multiplier_shift * curvature[k];
    }
    if (left <= moment_rounding) break;
  }
}

/// step <- A^-1 rest, A the derivative of `rest` where the factors `free` move.
template <int D>
void MomentSites<D>::solve_at_once(const std::vector<std::uint8_t>& free, const std::vector<Moments>& scale, const std::vector<Moments>& rest, std::vector<Moments>& step) {
  const auto n = static_cast<Eigen::Index>(size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * moments, n * moments);
  Eigen::VectorXd right(n * moments);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto site = static_cast<std::size_t>(k);
    A.diagonal().template segment<moments>(k * moments) += scale[site];
    right.template segment<moments>(k * moments) = rest[site];
    for (std::size_t b = first_[site]; b < first_[site + 1]; ++b) {
      if (!free[b]) continue;
      const Link& link = links_[b];
      const Moments own = link.weight * phi_[link.own_slot];
      A.template block<moments, moments>(k * moments, k * moments) += own * phi_[link.own_slot].transpose();
      A.template block<moments, moments>(k * moments, link.far * moments) += own * phi_[link.far_slot].transpose();
    }
  }
  const Eigen::VectorXd x = A.partialPivLu().solve(right);
  for (Eigen::Index k = 0; k < n; ++k) step[static_cast<std::size_t>(k)] = x.template segment<moments>(k * moments);
  ++iterations_;
}

/// The same until the largest component of what is left of `rest` is `wanted`.
template <int D>
void MomentSites<D>::solve_roughly(const std::vector<std::uint8_t>& free, const std::vector<Moments>& scale, const std::vector<Moments>& rest, double wanted, std::vector<Moments>& step) {
  const std::size_t n = size();
  using Vector = std::vector<Moments>;
  using Block = Eigen::Matrix<double, moments, moments>;
  std::vector<Eigen::LDLT<Block>> inverse(n);
  parallel_for(n, [&](std::size_t k) {
    Block block = scale[k].asDiagonal();
    for (std::size_t b = first_[k]; b < first_[k + 1]; ++b)
      if (free[b]) block += links_[b].weight * phi_[links_[b].own_slot] * phi_[links_[b].own_slot].transpose();
    inverse[k].compute(block);
  });
  const auto apply = [&](const Vector& x, Vector& y) {
    parallel_for(n, [&](std::size_t k) {
      Moments sum = scale[k].cwiseProduct(x[k]);
      for (std::size_t b = first_[k]; b < first_[k + 1]; ++b) {
        if (!free[b]) continue;
        const Link& link = links_[b];
        const double value = x[k].dot(phi_[link.own_slot]) + x[static_cast<std::size_t>(link.far)].dot(phi_[link.far_slot]);
        sum += link.weight * value * phi_[link.own_slot];
      }
      y[k] = sum;
    });
  };
  const auto precondition = [&](const Vector& x, Vector& y) { parallel_for(n, [&](std::size_t k) { y[k] = inverse[k].solve(x[k]); }); };
  const auto dot = [&](const Vector& a, const Vector& b) {
    double sum = 0;
    for (std::size_t k = 0; k < n; ++k) sum += a[k].dot(b[k]);
    return sum;
  };
  const auto largest = [](const Vector& a) {
    double most = 0;
    for (const Moments& m : a) most = std::max(most, m.cwiseAbs().maxCoeff());
    return most;
  };
  const Vector zero(n, Moments::Zero());
  Vector r = rest, p = zero, v = zero, s = zero, t = zero, z = zero, q = zero;
  const Vector shadow = rest;
  step = zero;
  double rho = 1, alpha = 1, omega = 1;
  for (int k = 0; k < most_products / 2 && largest(r) > wanted; ++k, iterations_ += 2) {
    const double next = dot(shadow, r);
    if (next == 0 || omega == 0) break;
    const double beta = next / rho * (alpha / omega);
    rho = next;
    for (std::size_t i = 0; i < n; ++i) p[i] = r[i] + beta * (p[i] - omega * v[i]);
    precondition(p, z);
    apply(z, v);
    const double along = dot(shadow, v);
    if (along == 0) break;
    alpha = rho / along;
    for (std::size_t i = 0; i < n; ++i) s[i] = r[i] - alpha * v[i];
    precondition(s, q);
    apply(q, t);
    const double square = dot(t, t);
    omega = square > 0 ? dot(t, s) / square : 0;
    for (std::size_t i = 0; i < n; ++i) {
      step[i] += alpha * z[i] + omega * q[i];
      r[i] = s[i] - omega * t[i];
    }
  }
}

template class MomentSites<1>;
template class MomentSites<2>;
template class MomentSites<3>;

}  // namespace perikit
