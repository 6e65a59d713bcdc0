#pragma once
/// Multipliers of bond factors, point by point. At each point i that is asked
///
///   even:  sum_j w_ij f_ij phi(n_ij) - e_0 = 0,   at points inside of clouds:  odd:  sum_j w_ij rho_ij f_ij psi(n_ij) = 0,   rho = delta/(2 |xi|),
///   f_ij = max(floor, 1 + (lambda_i + lambda_j) . phi(n_ij) + rho_ij (mu_i - mu_j) . psi(n_ij))   or what is known of a bond,
///
/// phi and psi the even and odd polynomials of a direction (moment_basis.hpp), w_ij = V_j w(|xi|, omega)/t. Newton's method around the method of multipliers, R(x) + shift S (x - x_0) = 0, S the curvatures, then
/// x_0 <- x; conjugate gradients solve for a step.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloud_balance/balance_solver.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "families/cloud/cloud_row_simd.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/rank_values.hpp"
#include "terms/pairs/moment_basis.hpp"
#include "terms/pairs/moment_factors.hpp"
#include "terms/pairs/point_copies.hpp"

namespace perikit {

/// The bonds of the points that are asked: those of points[k] are begin[k] ... end[k] - 1 in the arrays.
struct MomentBonds {
  std::vector<std::int32_t> points;
  std::vector<std::int64_t> begin, end;
  const std::int32_t* far = nullptr;
  // As many as a pack has can be read behind the last one of each.
  const double* weight = nullptr;     ///< w_ij
  const double* known = nullptr;      ///< f_ij; 0: to be found; null: all are
  double* factor = nullptr;           ///< f_ij, work
  std::vector<std::uint8_t> inside;   ///< by internal index: whether third moments are to vanish; empty: nowhere
};

/// Odd: third moments, too. directions(p, bond, far, phi, psi) gives the polynomials of a pack of bonds, psi with rho; far: as many far ends.
template <int D, bool Odd, class Directions>
class MomentPoints {
 public:
  static constexpr int even = even_moments<D>, odd = Odd ? odd_moments<D> : 0, moments = even + odd;

  MomentPoints(const Body& body, const MomentBonds& bonds, const PointCopies& copies, Directions directions)
      : body_(body), bonds_(bonds), copies_(copies), directions_(std::move(directions)), x_(make()), rest_(make()) {
    for (std::size_t k = 0; k < bonds_.points.size(); ++k) count_ += bonds_.end[k] - bonds_.begin[k];
    communicator().sum({&count_, 1});
  }

  void find() {
    if (count_ == 0) return;
    centre_ = make();
    set_curvature();
    held_.assign(body_.stride(), 0);
    double best = std::numeric_limits<double>::infinity();
    Field found = make();
    for (const double shift : shifts) {
      shift_ = shift;
      minimise();
      evaluate(0, nullptr);
      if (shift == first_multiplier_shift) hold_points();
      const double error = largest_error();
      if (error < best) std::copy_n(x_.data(), x_.size(), found.data());
      best = std::min(best, error);
      if (!(error > rounding_residual) || left() == 0) break;
      std::copy_n(x_.data(), x_.size(), centre_.data());
      for (const std::int32_t p : bonds_.points)
        for (int k = 0; k < moments && held_[static_cast<std::size_t>(p)]; ++k) centre_.component(k)[p] = 0;
    }
    std::copy_n(found.data(), found.size(), x_.data());
    evaluate(0, nullptr);
    show(x_);
  }
  int iterations() const noexcept { return iterations_; }
  /// f of a pack of bonds between any points that are asked, or are ghosts or images of such.
  Pack factors(std::size_t p, std::int64_t bond, const std::int32_t* far) const noexcept {
    Phi phi;
    Psi psi;
    directions_(p, bond, far, phi, psi);
    return max(Pack(least_factor), Pack(1.0) + value(p, far, phi, psi));
  }
  /// Largest error of a moment of a point that is asked.
  double error(std::size_t p) const noexcept {
    double most = 0;
    for (int k = 0; k < moments; ++k) most = std::max(most, std::abs(rest_.component(k)[p]) / body_.volume(p));
    return most;
  }

  // The system of balance_solver.hpp: V_i times the equations of point i.
  Field make() const { return body_.make_field(moments); }
  void apply(const Field& x, Field& y) {
    if (shown_.size() == 0) shown_ = make();
    std::copy_n(x.data(), x.size(), shown_.data());
    show(shown_);
    pass([&](std::size_t p, std::int64_t bond, const std::int32_t* far, std::uint8_t bits, const Phi& phi, const Psi& psi, Sums& sum) {
      add(free_weight(bond, bits) * value(p, far, phi, psi), phi, psi, sum);
    }, [&](std::size_t p, const Sum& sum) {
      for (int k = 0; k < moments; ++k) y.component(k)[p] = asked(p, k) ? body_.volume(p) * (sum[k] + shift(p, k) * x.component(k)[p]) : 0.0;
    });
  }
  void precondition(const Field& r, Field& z) const {
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) {
        const auto p = static_cast<std::size_t>(bonds_.points[k]);
        if (!has_block(p)) {
          for (int c = 0; c < moments; ++c) z.component(c)[p] = r.component(c)[p] * diagonal_.component(c)[p];
          continue;
        }
        Eigen::Matrix<double, even, 1> of_point;
        for (int c = 0; c < even; ++c) of_point[c] = r.component(c)[p];
        of_point = blocks_[k].solve(of_point).eval();
        for (int c = 0; c < moments; ++c) z.component(c)[p] = c < even ? of_point[c] : 0.0;
      }
    });
  }
  double largest(const Field& r) const {
    double most = 0;
    for (int k = 0; k < moments; ++k)
      for (const std::int32_t p : bonds_.points) most = std::max(most, std::abs(r.component(k)[p]) / body_.volume(static_cast<std::size_t>(p)));
    return communicator().largest(most);
  }

 private:
  /// Small shifts want few steps of many products, and large clouds never come to them.
  static constexpr double shifts[] = {first_multiplier_shift, first_multiplier_shift, 1e-3, later_multiplier_shift, later_multiplier_shift, later_multiplier_shift, later_multiplier_shift, later_multiplier_shift, later_multiplier_shift};
  static constexpr int most_rounds = 15;
  /// Multipliers of a point side by side, as loops over bonds want them.
  static constexpr std::size_t rows_of_point = (static_cast<std::size_t>(moments) + 3) / 4;
  using Phi = Pack[even_moments<D>];
  using Psi = Pack[odd_moments<D>];
  using Sums = Pack[static_cast<std::size_t>(moments)];
  using Sum = double[static_cast<std::size_t>(moments)];

  bool asked(std::size_t p, int k) const noexcept { return k < even || bonds_.inside[p]; }
  /// w of the bonds whose factors move, 0 of the others.
  Pack free_weight(std::int64_t bond, std::uint8_t bits) const noexcept {
    const Pack w = select(Pack::load(bonds_.factor + bond) > Pack(least_factor), Pack::load(bonds_.weight + bond), Pack(0.0));
    return keep(bits, bonds_.known ? select(Pack::load(bonds_.known + bond) > Pack(0.0), Pack(0.0), w) : w);
  }
  /// How many products are left: small clouds come to rounding within some seconds, large ones as near as so many allow.
  int left() const noexcept {
    return std::max(0, static_cast<int>(std::clamp(1.5e9 / (static_cast<double>(moments) * static_cast<double>(count_)), 80.0, 5000.0)) - iterations_);
  }

  /// Values of points -> their ghosts and images, as these are mirrored.
  void show(FieldView x) {
    if (copies_.copy) copies_.copy(x);
    static const MomentParity<D> parity;
    if (!copies_.mirrored.empty())
      for (const std::int32_t p : body_.internal())
        for (int a = 0; a < D; ++a) {
          if (copies_.mirrored[static_cast<std::size_t>(p)][static_cast<std::size_t>(a)] > 0) continue;
          for (int k = 0; k < moments; ++k)
            if (k < even ? parity.even[k][a] : parity.odd[k - even][a]) x.component(k)[p] = -x.component(k)[p];
        }
    rows_.resize(body_.stride() * rows_of_point);
    over_blocks(body_.stride(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        for (int k = 0; k < moments; ++k) rows_[p * rows_of_point + static_cast<std::size_t>(k) / 4][k % 4] = x.component(k)[p];
    });
  }
  double multiplier(std::size_t p, int k) const noexcept { return rows_[p * rows_of_point + static_cast<std::size_t>(k) / 4][k % 4]; }
  /// (lambda_i + lambda_j) . phi + (mu_i - mu_j) . psi
  Pack value(std::size_t p, const std::int32_t* far, const Phi& phi, const Psi& psi) const noexcept {
    Pack sum(0.0);
    PERIKIT_UNROLL for (std::size_t r = 0; r < rows_of_point; ++r) {
      const RowColumns others = RowColumns::load(rows_.data() + r, far, rows_of_point);
      PERIKIT_UNROLL for (int c = 0; c < 4; ++c) {
        const int k = 4 * static_cast<int>(r) + c;
        if (k >= moments) break;
        const Pack own(multiplier(p, k));
        if (k < even) sum += (own + others[c]) * phi[k];
        else sum += (own - others[c]) * psi[k - even];
      }
    }
    return sum;
  }
  Pack own_value(std::size_t p, const Phi& phi, const Psi& psi) const noexcept {
    Pack sum(0.0);
    for (int k = 0; k < even; ++k) sum += Pack(multiplier(p, k)) * phi[k];
    for (int k = 0; k < odd; ++k) sum += Pack(multiplier(p, even + k)) * psi[k];
    return sum;
  }
  static void add(Pack w, const Phi& phi, const Psi& psi, Sums& sum) noexcept {
    PERIKIT_UNROLL for (int k = 0; k < even; ++k) sum[k] += w * phi[k];
    PERIKIT_UNROLL for (int k = 0; k < odd; ++k) sum[even + k] += w * psi[k];
  }
  static void add_squares(Pack w, const Phi& phi, const Psi& psi, Sums& sum) noexcept {
    for (int k = 0; k < even; ++k) sum[k] += w * phi[k] * phi[k];
    for (int k = 0; k < odd; ++k) sum[even + k] += w * psi[k] * psi[k];
  }
  /// visit(bond, far, bits) for the bonds of a point, a pack at a time; bits: the lanes that are bonds.
  template <class Visit>
  void each_pack(std::size_t k, const Visit& visit) const {
    std::int32_t far[pack_width];
    for (std::int64_t b = bonds_.begin[k]; b < bonds_.end[k]; b += pack_width) {
      const int n = static_cast<int>(std::min<std::int64_t>(pack_width, bonds_.end[k] - b));
      std::copy_n(bonds_.far + b, n, far);
      std::fill(far + n, far + pack_width, far[0]);
      visit(b, far, first_lanes(n));
    }
  }
  /// visit(p, bond, far, bits, phi, psi, sums) for all bonds of a point, then end(p, sum).
  template <class Visit, class End>
  void pass(const Visit& visit, const End& end) const {
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      Phi phi;
      Psi psi;
      for (std::size_t k = first; k < last; ++k) {
        const auto p = static_cast<std::size_t>(bonds_.points[k]);
        Sums sums = {};
        each_pack(k, [&](std::int64_t bond, const std::int32_t* far, std::uint8_t bits) {
          directions_(p, bond, far, phi, psi);
          visit(p, bond, far, bits, phi, psi, sums);
        });
        Sum sum = {};
        for (int c = 0; c < moments; ++c)
          for (int l = 0; l < pack_width; ++l) sum[c] += sums[c][l];
        end(p, sum);
      }
    });
  }

  double shift(std::size_t p, int k) const noexcept { return (held_[p] ? first_multiplier_shift : shift_) * curvature_.component(k)[p]; }

  /// The convex function of x whose derivative is V (R + shift S (x - x_0)), from x_ on.
  void minimise() {
    double value = 0, last = std::numeric_limits<double>::infinity();
    const bool first = shift_ == first_multiplier_shift;   // no more than that
    evaluate(1, &value);
    for (int round = 0; round < most_rounds; ++round) {
      const double error = largest(rest_);
      if (error <= (first ? 0.1 * first_allowed : rounding_residual) || (error < 1e-9 && error > 0.5 * last) || left() == 0) break;
      last = error;
      set_preconditioner();
      const Solved step = solve(*this, rest_, std::max(0.3 * rounding_residual, (first ? 0.2 : std::min(0.1, error)) * error), {std::min(left(), 3000), std::min(left(), 3000)});
      iterations_ += step.iterations;
      const double slope = dot(rest_, step.x);
      if (step.contradiction || !(slope > 0)) break;
      double length = 1, before = value;
      combine(1, x_, 1, step.x, x_);
      for (int halving = 0; halving < 12; ++halving, length *= 0.5) {
        if (halving > 0) combine(1, x_, -length, step.x, x_);
        evaluate(1, &value);
        if (value <= before - 1e-4 * length * slope + 1e-14 * std::abs(before)) break;
      }
    }
  }
  /// Of the points that are not held.
  double largest_error() const {
    double most = 0;
    for (const std::int32_t p : bonds_.points)
      if (!held_[static_cast<std::size_t>(p)]) most = std::max(most, error(static_cast<std::size_t>(p)));
    return communicator().largest(most);
  }
  /// Points whose moments are still off by so much cannot have them: they stay near x_0 = 0, as all do at first.
  void hold_points() {
    for (const std::int32_t p : bonds_.points)
      if (error(static_cast<std::size_t>(p)) > first_allowed) held_[static_cast<std::size_t>(p)] = 1;
  }

  /// f of x_, and rest_ <- -V (R + with_shift shift S (x_ - x_0)); the function of `minimise` where that is wanted.
  void evaluate(double with_shift, double* function) {
    show(x_);
    Field parts;
    if (function) parts = body_.make_field(1);
    pass([&](std::size_t p, std::int64_t bond, const std::int32_t* far, std::uint8_t bits, const Phi& phi, const Psi& psi, Sums& sum) {
      const Pack y = value(p, far, phi, psi), w = keep(bits, Pack::load(bonds_.weight + bond)), floor(least_factor);
      const Pack known = bonds_.known ? Pack::load(bonds_.known + bond) : Pack(0.0), found = max(floor, Pack(1.0) + y), f = select(known > Pack(0.0), known, found);
      for (int l = 0; l < pack_width; ++l)
        if (bits >> l & 1) bonds_.factor[bond + l] = f[l];
      add(w * f, phi, psi, sum);
      if (!function) return;
      // Half of w H(y), H' = f, for bonds whose other half the other end has.
      const Pack moving = y + Pack(0.5) * (y * y), resting = floor * y - Pack(0.5 * (1 - least_factor) * (1 - least_factor));
      const Pack part = w * select(known > Pack(0.0), known * own_value(p, phi, psi), Pack(0.5) * select(found > floor, moving, resting));
      for (int l = 0; l < pack_width; ++l) parts.data()[p] += part[l];
    }, [&](std::size_t p, Sum& sum) {
      sum[0] -= 1;
      double square = 0;
      for (int k = 0; k < moments; ++k) {
        const double moved = x_.component(k)[p] - centre_.component(k)[p], pull = with_shift * shift(p, k) * moved;
        rest_.component(k)[p] = asked(p, k) ? -body_.volume(p) * (sum[k] + pull) : 0.0;
        square += 0.5 * pull * moved;
      }
      if (function) parts.data()[p] = body_.volume(p) * (parts.data()[p] - x_.component(0)[p] + square);
    });
    clear_others();
    if (!function) return;
    ExactSum total;
    for (const std::int32_t p : bonds_.points) total.add(parts.data()[p]);
    *function = total_over_ranks(total);
  }
  /// What ghosts and images have counts for nothing in sums.
  void clear_others() {
    if (!copies_.copy) return;
    if (own_.empty()) {
      own_.assign(body_.stride(), 0);
      for (const std::int32_t p : bonds_.points) own_[static_cast<std::size_t>(p)] = 1;
    }
    for (int k = 0; k < moments; ++k)
      for (std::size_t p = 0; p < body_.stride(); ++p)
        if (!own_[p]) x_.component(k)[p] = 0;
  }
  /// S, of all factors that are to be found.
  void set_curvature() {
    curvature_ = make();
    pass([&](std::size_t, std::int64_t bond, const std::int32_t*, std::uint8_t bits, const Phi& phi, const Psi& psi, Sums& sum) {
      const Pack w = keep(bits, Pack::load(bonds_.weight + bond));
      add_squares(bonds_.known ? select(Pack::load(bonds_.known + bond) > Pack(0.0), Pack(0.0), w) : w, phi, psi, sum);
    }, [&](std::size_t p, const Sum& sum) {
      // A polynomial that vanishes along all these bonds has none.
      double most = 0;
      for (const double curvature : sum) most = std::max(most, curvature);
      for (int k = 0; k < moments; ++k) curvature_.component(k)[p] = 1e-300 + sum[k] + 1e-2 * most;
    });
  }
  /// Of a point near a surface the even moments together: its bonds do not lie in all directions.
  using Block = Eigen::Matrix<double, even, even>;
  void set_preconditioner() {
    if (diagonal_.size() == 0) diagonal_ = make();
    blocks_.resize(bonds_.points.size());
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) set_preconditioner(k);
    });
  }
  bool has_block(std::size_t p) const noexcept { return !Odd || !bonds_.inside[p]; }
  void set_preconditioner(std::size_t k) {
    const auto p = static_cast<std::size_t>(bonds_.points[k]);
    Phi phi;
    Psi psi;
    Sums squares = {};
    Pack products[even][even] = {};
    each_pack(k, [&](std::int64_t bond, const std::int32_t* far, std::uint8_t bits) {
      directions_(p, bond, far, phi, psi);
      const Pack w = free_weight(bond, bits);
      add_squares(w, phi, psi, squares);
      for (int a = 0; a < even && has_block(p); ++a)
        for (int b = 0; b <= a; ++b) products[a][b] += w * phi[a] * phi[b];
    });
    const auto total = [](Pack pack) {
      double sum = 0;
      for (int l = 0; l < pack_width; ++l) sum += pack[l];
      return sum;
    };
    for (int c = 0; c < moments; ++c) diagonal_.component(c)[p] = 1 / (body_.volume(p) * (total(squares[c]) + shift(p, c)));
    if (!has_block(p)) return;
    Block block;
    for (int a = 0; a < even; ++a)
      for (int b = 0; b <= a; ++b) block(a, b) = block(b, a) = body_.volume(p) * (total(products[a][b]) + (a == b ? shift(p, a) : 0.0));
    blocks_[k].compute(block);
  }

  const Body& body_;
  const MomentBonds& bonds_;
  const PointCopies& copies_;
  Directions directions_;
  Field x_, centre_, rest_, shown_, diagonal_, curvature_;   ///< (lambda, mu); x_0; -V R; work; the inverse of the diagonal; S
  AlignedVector<Row> rows_;
  std::vector<Eigen::LDLT<Block>> blocks_;   ///< by point that is asked
  std::vector<std::uint8_t> own_, held_;   ///< by point
  double shift_ = 0;
  std::int64_t count_ = 0;
  int iterations_ = 0;
};

}  // namespace perikit
