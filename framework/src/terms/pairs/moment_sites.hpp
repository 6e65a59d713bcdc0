#pragma once
/// Bond factors of least change under conditions on fourth moments, on the bonds of a lattice. Points that see the same of the body are one site. At each site
///
///   R_s = sum_b w_b f_b phi(n_b) - e_0 = 0,   f_b = 1 + lambda_s . phi(n_b) + lambda_far . phi(n_b), not below the floor nor above the ceiling,
///
/// phi the even polynomials of a direction (moment_basis.hpp): the f_b within these bounds with the least sum of w_b (f_b - 1)^2 that have these moments, lambda being the
/// multipliers. Where no f has them, those with the least sum of R^2 are found.

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "terms/pairs/moment_basis.hpp"
#include "terms/pairs/moment_factors.hpp"

namespace perikit {

template <int D>
class MomentSites {
 public:
  static constexpr int moments = even_moments<D>;
  using Moments = Eigen::Matrix<double, moments, 1>;

  struct Link {
    std::int32_t far;        ///< the site at the other end
    std::uint16_t own_slot;  ///< direction of the bond as this site has it
    std::uint16_t far_slot;  ///< and as the other one has it
    double weight;           ///< w_b, over the trace that is wanted
    double fixed;            ///< f_b where it is known; 0: it is to be found
  };

  /// directions: n of the slots that links name; most: no factor is above.
  MomentSites(std::span<const std::array<double, D>> directions, double most);
  /// The sites one after the other; links may name sites that come later. count: in how many places a site lies, as often as far ends count it.
  void add(std::span<const Link> links, double count = 1);
  std::size_t size() const noexcept { return first_.size() - 1; }
  /// Finds all multipliers.
  void solve();

  const Moments& multiplier(std::size_t site) const noexcept { return lambda_[site]; }
  const Moments& polynomials(std::size_t slot) const noexcept { return phi_[slot]; }
  /// f of a bond between two sites.
  double factor(std::size_t site, std::size_t own_slot, std::size_t far, std::size_t far_slot) const noexcept;
  /// Error of the moments of a site, the root of the sum of their squares.
  double error(std::size_t site) const noexcept { return error_[site]; }
  /// Systems and products with matrices that this took.
  int iterations() const noexcept { return iterations_; }

 private:
  /// f of 1 + y.
  double bounded(double y) const noexcept { return std::clamp(1 + y, least_factor, most_); }
  Moments residual(std::size_t site) const;
  double merit(std::size_t site) const;
  void solve_at_once(const std::vector<std::uint8_t>& free, const std::vector<double>& scale, const std::vector<Moments>& rest, std::vector<Moments>& step);
  void descend(const std::vector<double>& curvature, const std::vector<std::uint8_t>& found);

  double most_;
  std::vector<Moments> phi_;
  std::vector<Link> links_;
  std::vector<std::size_t> first_{0};
  std::vector<Moments> lambda_;
  std::vector<double> error_, count_;
  int iterations_ = 0;
};

}  // namespace perikit
