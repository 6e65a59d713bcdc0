#include "volume_equations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "block_product.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

constexpr double schur_accuracy = 0.1;  // of the two solves with L: a better one saves few iterations of the outer method
constexpr double correction_accuracy = 0.05;
constexpr int most_products = 200, least_corrections = 3, most_corrections = 12;
constexpr double full_weight = 50;        // in shear moduli: errors of volumes count as forces up to such W
constexpr double most_with_waves = 1000;  // ratio: beyond it W^-1 loses no waves of bodies of up to 30 points a side, and is faster
constexpr double small_pressure = 0.1;    // in shear moduli: an error of it leaves the tangent as it is

/// Sum of term(k) over [0, n) and all ranks.
template <class Term>
double sum_of(std::size_t n, Term&& term) {
  return total_over_ranks(exact_sum(n, term));
}

}  // namespace

VolumeEquations::VolumeEquations(Problem& problem, std::unique_ptr<VolumetricPart> volumes)
    : problem_(problem), volumes_(std::move(volumes)), R_(problem) {
  for (Field* scalar : {&W_, &inverse_W_, &active_, &row_scales_, &inverse_diagonal_, &residual_, &direction_, &product_, &first_,
                        &second_, &compliant_})
    *scalar = problem.points().make_field(1);
  for (Field* vector : {&inverse_D_, &force_, &action_, &power_}) *vector = problem.make_field();
}

EvaluationStatus VolumeEquations::linearise(ConstFieldView u, const BlockMatrix& companion, ConstFieldView free) {
  companion_ = &companion;
  free_ = free;
  EvaluationStatus status = volumes_->linearise(u);
  if (!status.ok()) return status;
  const auto d = static_cast<std::size_t>(companion.dimension);
  parallel_for(companion.rows(), [&](std::size_t r) {
    for (std::int64_t b = companion.row_first[r]; b < companion.row_first[r + 1]; ++b) {
      const auto block = static_cast<std::size_t>(b);
      if (static_cast<std::size_t>(companion.column[block]) != r) continue;
      for (std::size_t a = 0; a < d; ++a) {
        const auto p = static_cast<std::size_t>(companion.point[r]);
        const double stiffness = companion.values[(block * d + a) * d + a];  // images have none
        inverse_D_.component(static_cast<int>(a))[p] =
            stiffness > 0 && free.component(static_cast<int>(a))[p] != 0 ? 1 / stiffness : 0.0;
      }
    }
  });
  fill(1.0, force_);
  volumes_->squares(force_, row_scales_);
  volumes_->squares(inverse_D_, inverse_diagonal_);
  for (Field* scalar : {&W_, &inverse_W_, &active_}) fill(0.0, *scalar);
  largest_ratio_ = 0;
  for (const std::int32_t index : problem_.points().owned()) {
    const auto p = static_cast<std::size_t>(index);
    const double shear = problem_.laws().moduli(p).mu * problem_.points().volume(p);
    const double excess = volumes_->stiffness().data[p] - ordinary * shear;
    if (excess <= 0) continue;
    row_scales_.data()[p] = std::sqrt(row_scales_.data()[p]) * std::max(excess / 100, std::min(excess, full_weight * shear));
    W_.data()[p] = excess;
    inverse_W_.data()[p] = 1 / excess;
    largest_ratio_ = std::max(largest_ratio_, excess / shear);
    active_.data()[p] = 1;
    inverse_diagonal_.data()[p] = 1 / (inverse_diagonal_.data()[p] + 1 / excess);
  }
  mask(active_, inverse_diagonal_);
  largest_ratio_ = communicator().largest(largest_ratio_);
  waves_ = largest_ratio_ <= most_with_waves;
  if (waves_) R_.make(companion, inverse_W_);
  return status;
}

void VolumeEquations::rates(ConstFieldView w, FieldView q) const {
  volumes_->rates(w, q);
  mask(active_, q);
}

void VolumeEquations::forces(ConstFieldView q, FieldView f) const {
  volumes_->forces(q, f);
  mask(free_, f);
}

double VolumeEquations::multiply(ConstFieldView p, bool waves, FieldView Lp) {
  volumes_->forces(p, force_);
  mask(inverse_D_, force_);   // 0 on prescribed components
  volumes_->rates(force_, Lp);
  if (waves) R_.multiply(p, compliant_);
  return sum_of(p.size(), [&](std::size_t k) {
    Lp.data[k] = active_.data()[k] * Lp.data[k] + (waves ? compliant_.data()[k] : inverse_W_.data()[k] * p.data[k]);
    return p.data[k] * Lp.data[k];
  });
}

void VolumeEquations::multiply_commutator(ConstFieldView p, FieldView Mp) {
  forces(p, force_);
  mask(inverse_D_, force_);
  // M = C (1 + X)^-1, X = D^-1 C, and 1/(1 + x) by a polynomial on [0, 2], where the eigenvalues of X are.
  copy(force_, power_);
  const auto multiply_scaled = [&](FieldView w) {
    problem_.share(w);
    perikit::multiply(*companion_, w, action_);
    mask(inverse_D_, action_);
  };
  for (const double coefficient : {-0.75, 0.22}) {
    multiply_scaled(power_);
    std::swap(power_, action_);
    combine(1, force_, coefficient, power_, force_);
  }
  multiply_scaled(force_);
  rates(action_, Mp);
  if (waves_) {
    R_.multiply(p, product_);
    mask(W_, product_);
    R_.multiply(product_, compliant_);
  } else {
    copy(p, compliant_);
    mask(inverse_W_, compliant_);
  }
  combine(1, Mp, 1, compliant_, Mp);
}

double VolumeEquations::scaled_square(ConstFieldView b) const {
  return sum_of(b.size(), [&](std::size_t k) { return b.data[k] * (inverse_diagonal_.data()[k] * b.data[k]); });
}

/// Conjugate gradients with the diagonal of L, each step in as few passes over the fields as there are sums to wait for.
void VolumeEquations::improve(double target, bool waves, FieldView x) {
  const std::size_t n = x.size();
  double* const residual = residual_.data();
  double* const direction = direction_.data();
  const double* const scale = inverse_diagonal_.data();
  double size = scaled_square(residual_), last = INFINITY;
  for (int products = 0; products < most_products && size > target; ++products) {
    over_blocks(n, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) direction[k] = scale[k] * residual[k] + (products > 0 ? size / last * direction[k] : 0.0);
    });
    const double step = size / multiply(direction_, waves, product_);
    last = size;
    size = sum_of(n, [&](std::size_t k) {
      x.data[k] += step * direction[k];
      residual[k] -= step * product_.data()[k];
      return residual[k] * (scale[k] * residual[k]);
    });
  }
}

void VolumeEquations::solve(ConstFieldView b, double accuracy, bool waves, FieldView x) {
  fill(0.0, x);
  copy(b, residual_);
  improve(accuracy * accuracy * scaled_square(b), waves, x);
}

void VolumeEquations::solve_schur(ConstFieldView r, FieldView p) {
  solve(r, schur_accuracy, waves_, first_);
  multiply_commutator(first_, second_);
  // The second solve begins at the multiple of the first one's result that is best in the norm of L: L first is what its residual lacks.
  const std::size_t n = r.size();
  const auto of_first = [&](std::size_t k) { return r.data[k] - residual_.data()[k]; };
  const double wanted = sum_of(n, [&](std::size_t k) { return second_.data()[k] * first_.data()[k]; }),
               own = sum_of(n, [&](std::size_t k) { return of_first(k) * first_.data()[k]; });
  const double share = own > 0 ? wanted / own : 0.0;
  over_blocks(n, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      p.data[k] = share * first_.data()[k];
      residual_.data()[k] = second_.data()[k] - share * of_first(k);
    }
  });
  improve(schur_accuracy * schur_accuracy * scaled_square(second_), waves_, p);
}

double VolumeEquations::largest_pressure(ConstFieldView error) const {
  double most = 0;
  for (const std::int32_t index : problem_.points().owned()) {
    const auto p = static_cast<std::size_t>(index);
    const double shear = problem_.laws().moduli(p).mu * problem_.points().volume(p);
    most = std::max(most, W_.data()[p] * std::abs(error.data[p]) / shear);
  }
  return communicator().largest(most);
}

std::pair<double, double> VolumeEquations::correct(ConstFieldView u, ConstFieldView growth, double enough, FieldView du) {
  Field target = problem_.points().make_field(1), error = problem_.points().make_field(1), moved = problem_.make_field();
  combine(1, growth, 1, volumes_->logarithms(), target);
  double before = 0, last = 0;
  for (int round = 0;; ++round) {
    combine(1, u, 1, du, moved);
    const bool admissible = volumes_->linearise(moved).ok();
    if (!admissible && round == 0) return {0, 0};  // the line search will look into it
    combine(1, volumes_->logarithms(), -1, target, error);
    mask(active_, error);
    const double size = admissible ? norm(error) : std::numeric_limits<double>::infinity();
    if (round == 0) before = size;
    if (round > 0 && !(size < last)) {
      combine(1, du, 1, action_, du);  // the last correction was none
      return {before, last};
    }
    last = size;
    copy(error, second_);
    mask(W_, second_);
    forces(second_, force_);
    if (round == most_corrections || norm(force_) <= enough || (round >= least_corrections && largest_pressure(error) <= small_pressure))
      return {before, size};
    // The least motion z in the norm of D with B z = -error: z = -D^-1 B^T (B D^-1 B^T)^-1 error.
    solve(error, correction_accuracy, false, first_);
    forces(first_, action_);
    mask(inverse_D_, action_);
    combine(1, du, -1, action_, du);
  }
}

}  // namespace perikit
