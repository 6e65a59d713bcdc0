#include "terms/pairs/moment_sites.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

constexpr int most_steps = 8, most_rounds = 20;
/// Of a descent: the steps that pull multipliers to zero, and the links that it may pass in all.
constexpr int first_steps = 50;
constexpr double most_links = 2e7;
/// Unknowns of a small system.
constexpr std::size_t most_at_once = 700;
/// Moments with errors below this have what was asked for.
constexpr double moment_rounding = 1e-13;

}  // namespace

template <int D>
MomentSites<D>::MomentSites(std::span<const std::array<double, D>> directions, double most) : most_(most) {
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
  return bounded(own + other);
}

/// Half of sum_b w_b H(y_b), H' = f, for bonds whose other half the other end has; less what is asked for.
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
    const double f = bounded(y);
    sum += 0.5 * link.weight * (f == 1 + y ? y + 0.5 * y * y : f * y - 0.5 * (f - 1) * (f - 1));
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
/// of a large shift, sites that cannot have their moments stay with that shift and lambda_0 = 0. Large systems go down by steps.
template <int D>
void MomentSites<D>::solve() {
  const std::size_t n = size();
  const bool small = n * moments <= most_at_once;
  lambda_.assign(n, Moments::Zero());
  error_.assign(n, 0.0);
  std::vector<double> scale(n), curvature(n);
  std::vector<Moments> centre(n, Moments::Zero()), rest(n), before(n), step(n);
  std::vector<std::uint8_t> free(links_.size(), 0), found(n), held(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    // The mean over all directions of a polynomial, the same however the axes are turned; a site with nothing to find has none.
    double mean = 0;
    for (std::size_t b = first_[k]; b < first_[k + 1]; ++b)
      if (links_[b].fixed == 0) mean += links_[b].weight;
    found[k] = mean > 0;
    curvature[k] = found[k] ? mean : 1.0;
    scale[k] = first_multiplier_shift * curvature[k];
  }
  if (!small) {
    descend(curvature, found);
    return;
  }
  const auto over_sites = [&](auto body) { parallel_for(n, body); };
  // rest <- R + shift S (lambda - lambda_0), and the convex function that this is the derivative of.
  std::vector<double> merits(n);
  const auto evaluate = [&] {
    over_sites([&](std::size_t k) {
      const Moments moved = lambda_[k] - centre[k];
      rest[k] = found[k] ? Moments(residual(k) + scale[k] * moved) : Moments::Zero();
      merits[k] = found[k] ? count_[k] * (merit(k) + 0.5 * scale[k] * moved.squaredNorm()) : 0.0;
    });
    return std::accumulate(merits.begin(), merits.end(), 0.0);
  };
  for (int outer = 0; outer < most_steps; ++outer) {
    double value = evaluate(), last = std::numeric_limits<double>::infinity();
    for (int round = 0; round < most_rounds; ++round) {
      double error = 0;
      for (const Moments& r : rest) error = std::max(error, r.norm());
      if (error <= 0.5 * moment_rounding || (error <= 1e-9 && error > 0.5 * last)) break;
      last = error;
      over_sites([&](std::size_t k) {
        for (std::size_t b = first_[k]; b < first_[k + 1]; ++b) {
          const Link& link = links_[b];
          const double f = factor(k, link.own_slot, static_cast<std::size_t>(link.far), link.far_slot);
          free[b] = link.fixed == 0 && f > least_factor && f < most_;
        }
      });
      solve_at_once(free, scale, rest, step);
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
      error_[k] = rest[k].norm();
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
void MomentSites<D>::solve_at_once(const std::vector<std::uint8_t>& free, const std::vector<double>& scale, const std::vector<Moments>& rest, std::vector<Moments>& step) {
  const auto n = static_cast<Eigen::Index>(size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * moments, n * moments);
  Eigen::VectorXd right(n * moments);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto site = static_cast<std::size_t>(k);
    A.diagonal().template segment<moments>(k * moments).array() += scale[site];
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

/// Accelerated descent in the norm of the blocks on the diagonal, as in moment_points.hpp. Counts of sites are weights of the function, and of the blocks with it.
template <int D>
void MomentSites<D>::descend(const std::vector<double>& curvature, const std::vector<std::uint8_t>& found) {
  const std::size_t n = size();
  // With as many components as fill registers.
  using Padded = Eigen::Matrix<double, (moments + 7) / 8 * 8, 1>;
  using Block = Eigen::Matrix<double, moments, moments>;
  const auto pad = [](const Moments& moments_of) {
    Padded padded = Padded::Zero();
    padded.template head<moments>() = moments_of;
    return padded;
  };
  std::vector<Padded> phi, at(n, Padded::Zero()), next(n), x(n, Padded::Zero());
  for (const Moments& polynomials_of : phi_) phi.push_back(pad(polynomials_of));
  std::vector<double> pull(n);
  std::vector<Block> inverse(n);
  std::vector<double> along(n);
  const auto set_blocks = [&] {
    parallel_for(n, [&](std::size_t k) {
      Block block = (pull[k] + 1e-3 * curvature[k]) * Block::Identity();
      for (std::size_t b = first_[k]; b < first_[k + 1]; ++b)
        if (links_[b].fixed == 0) block += links_[b].weight * phi_[links_[b].own_slot] * phi_[links_[b].own_slot].transpose();
      inverse[k] = block.llt().solve(Block::Identity());
    });
  };
  const auto residual_at = [&](std::size_t k) {
    Padded sum = Padded::Zero();
    for (std::size_t b = first_[k]; b < first_[k + 1]; ++b) {
      const Link& link = links_[b];
      const Padded& own = phi[link.own_slot];
      const double f = link.fixed > 0 ? link.fixed : bounded(at[k].dot(own) + at[static_cast<std::size_t>(link.far)].dot(phi[link.far_slot]));
      sum += (link.weight * f) * own;
    }
    sum[0] -= 1;
    return Moments(sum.template head<moments>());
  };
  for (std::size_t k = 0; k < n; ++k) pull[k] = first_multiplier_shift * curvature[k];
  set_blocks();
  const int steps = static_cast<int>(std::clamp(most_links / static_cast<double>(links_.size()), 2.0 * first_steps, 1000.0));
  double momentum = 1;
  for (int step = 0; step < steps; ++step, ++iterations_) {
    if (step == first_steps) {
      // Sites that cannot have their moments stay near 0.
      parallel_for(n, [&](std::size_t k) {
        if (residual_at(k).norm() <= first_allowed) pull[k] = 0;
      });
      set_blocks();
    }
    const double later = 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum)), share = (momentum - 1) / later;
    parallel_for(n, [&](std::size_t k) {
      if (!found[k]) {
        next[k] = Padded::Zero();
        along[k] = 0;
        return;
      }
      const Moments r = residual_at(k) + pull[k] * at[k].template head<moments>();
      const Padded reached = at[k] - pad(Moments(inverse[k] * r / 1.5)), moved = reached - x[k];
      along[k] = -count_[k] * r.dot(moved.template head<moments>());
      x[k] = reached;
      next[k] = reached + share * moved;
    });
    at.swap(next);
    momentum = std::accumulate(along.begin(), along.end(), 0.0) < 0 ? 1 : later;
  }
  for (std::size_t k = 0; k < n; ++k) lambda_[k] = x[k].template head<moments>();
  parallel_for(n, [&](std::size_t k) { error_[k] = residual(k).norm(); });
}

template class MomentSites<1>;
template class MomentSites<2>;
template class MomentSites<3>;

}  // namespace perikit
