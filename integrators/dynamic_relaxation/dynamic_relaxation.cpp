#include "dynamic_relaxation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"
#include "perikit/sdk/eigenvalue.hpp"
#include "perikit/sdk/stability.hpp"
#include "perikit/sdk/tangent_predictor.hpp"

namespace perikit {

namespace {

constexpr double safety = 1.1;            // of the largest eigenvalue, against stiffening within a step
constexpr double diverging = 1e3;         // residual over the smallest so far, at which the mass is found anew
constexpr double too_stiff = 3.8;         // Rayleigh quotient of the motion; with the mass that was found it is 4/1.1 at most
constexpr int stalled = 2000;             // iterations without a smaller residual, of kinetic damping
constexpr int note_every = 1000;

/// The sum of (a/of_a) (b/of_b): products of small or large numbers leave the range of numbers.
double product(ConstFieldView a, ConstFieldView b, double of_a, double of_b) {
  return total_over_ranks(exact_sum(a.size(), [&](std::size_t k) { return (a.data[k] / of_a) * (b.data[k] / of_b); }));
}

}  // namespace

Relaxation::Relaxation(Problem& problem, const RelaxationOptions& options)
    : options_(options), eigenvector_(problem.state().declare("relaxation_eigenvector")), r_(problem.make_field()),
      last_r_(problem.make_field()), v_(problem.make_field()) {}

double Relaxation::find_mass(Equilibrium& equilibrium) {
  // Central differences of step 1 are stable while omega_max^2 = lambda_max/m <= 4.
  return safety / 4 *
         largest_eigenvalue(equilibrium.problem(), equilibrium.displacement(), equilibrium.free(), eigenvector_, norm(eigenvector_) > 0,
                            [&] { return equilibrium.goes_on(); });
}

Solution Relaxation::solve(Equilibrium& equilibrium, bool extrapolated) {
  Solution solution;
  const FieldView u = equilibrium.displacement();
  if (!predict_by_tangent(equilibrium, extrapolated)) {
    solution.failure = equilibrium.failure();
    return solution;
  }
  double mass = 0, smallest = 0, frequency = 0, last_kinetic = 0;
  const auto start = [&] {
    fill(0.0, v_);
    last_kinetic = 0;
    mass = find_mass(equilibrium);
  };
  bool at_rest = true;   // v holds no motion yet
  int best = 0;          // iteration of the smallest residual
  // Of laws with history unloading may be stiffer than the tangent at which the mass was found.
  const auto raise_mass = [&](double by) {
    mass *= by;
    fill(0.0, v_);
    last_kinetic = 0;
    at_rest = true;
    best = solution.iterations;
  };
  for (;; ++solution.iterations) {
    if (!equilibrium.residual(u, r_)) {
      solution.failure = equilibrium.failure();
      return solution;
    }
    if (equilibrium.converged()) break;
    if (solution.iterations % note_every == 0) equilibrium.note(fmt::format("  iteration {:6}  residual {:.3e}", solution.iterations, equilibrium.relative_residual()));
    if (solution.iterations >= options_.load_steps.max_iterations) {
      solution.failure = fmt::format("the residual is {:.3g} (tolerance {:.3g}) after {} iterations", equilibrium.relative_residual(), equilibrium.tolerance(), solution.iterations);
      return solution;
    }
    const double residual = equilibrium.residual_norm();
    if (!(smallest > 0) || residual < smallest) {
      smallest = residual;
      best = solution.iterations;
    }
    if (mass == 0 || residual > diverging * smallest) {
      start();
      at_rest = true;
      smallest = residual;
      if (!(mass > 0)) {
        solution.failure = equilibrium.stopped() ? equilibrium.failure() : "the stiffness of the free points is zero or cannot be found";
        return solution;
      }
    }
    if (options_.kinetic && solution.iterations - best > stalled) raise_mass(1.5);
    if (at_rest) {
      combine(0.5 / mass, r_, 0, r_, v_);
      at_rest = false;
    } else if (options_.kinetic) {
      combine(1, v_, 1 / mass, r_, v_);
      const double kinetic = norm(v_);   // its root
      if (kinetic < last_kinetic) {
        // The peak lies behind: rest there, half of the last velocity v - r/m back.
        combine(1, u, -0.5, v_, u);
        combine(1, u, 0.5 / mass, r_, u);
        fill(0.0, v_);
        at_rest = true;
        last_kinetic = 0;
        continue;
      }
      last_kinetic = kinetic;
    } else {
      // Rayleigh quotient of the motion itself: it tends to the lowest frequency as the others die out.
      const double speed = norm(v_), unit = power_of_two(speed);
      const double curvature = product(v_, last_r_, unit, mass * unit) - product(v_, r_, unit, mass * unit);
      const double quotient = speed > 0 ? curvature / ((speed / unit) * (speed / unit)) : 0.0;
      if (quotient > too_stiff) {
        raise_mass(safety * quotient / 4);
        continue;
      }
      if (speed > 0) frequency = std::sqrt(std::clamp(quotient, 0.0, 3.6));
      const double c = frequency;   // critical: c dt/2 = omega
      combine((1 - c) / (1 + c), v_, 1 / (mass * (1 + c)), r_, v_);
    }
    combine(1, u, 1, v_, u);
    std::swap(last_r_, r_);
  }
  equilibrium.note(fmt::format("  iteration {:6}  residual {:.3e}", solution.iterations, equilibrium.relative_residual()));
  solution.converged = true;
  return solution;
}

bool Relaxation::unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) {
  return last && has_negative_curvature(equilibrium, u);
}

void DynamicRelaxation::run(Problem& problem, Observer& observer) {
  Relaxation relaxation(problem, options_);
  run_load_steps("dynamic_relaxation", options_.load_steps, problem, observer, relaxation);
}

}  // namespace perikit
