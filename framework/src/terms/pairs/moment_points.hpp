#pragma once
/// Multipliers of bond factors, point by point. At each point i that is asked
///
///   even:  sum_j w_ij f_ij phi(n_ij) - e_0 = 0,   at points inside of clouds:  odd:  sum_j w_ij rho_ij f_ij psi(n_ij) = 0,   rho = delta/(2 |xi|),
///   f_ij = 1 + (lambda_i + lambda_j) . phi(n_ij) + rho_ij (mu_i - mu_j) . psi(n_ij), not below the floor nor above the ceiling, or what is known of a bond,
///
/// phi and psi the even and odd polynomials of a direction (moment_basis.hpp), w_ij = V_j w(|xi|, omega)/t. Newton's method around the method of multipliers, R(x) + shift S (x - x_0) = 0, S the curvatures, then
/// x_0 <- x, after an accelerated descent. Steps of both are found in packs P, of doubles or of singles; what they leave is found in doubles.

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "families/cloud/cloud_row_simd.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/power_of_two.hpp"
#include "perikit/core/rank_values.hpp"
#include "terms/pairs/moment_basis.hpp"
#include "terms/pairs/moment_factors.hpp"
#include "terms/pairs/point_copies.hpp"
#include "terms/pairs/single_packs.hpp"

namespace perikit {

/// The bonds of the points that are asked: those of points[k] are begin[k] ... end[k] - 1 in the arrays.
struct MomentBonds {
  std::vector<std::int32_t> points;
  std::vector<std::int64_t> begin, end;
  const std::int32_t* far = nullptr;
  // As many as a pack has can be read behind the last one of each.
  const double* weight = nullptr;     ///< w_ij
  const double* known = nullptr;      ///< f_ij; 0: to be found; null: all are
  std::vector<std::uint8_t> inside;   ///< by internal index: whether third moments are to vanish; empty: nowhere
};

/// Odd: third moments, too. directions(p, bond, far, phi, psi) gives the polynomials of a pack of bonds, of doubles or of singles, psi with rho; far: as many far ends.
/// P: packs of conjugate gradients and of the descent, of doubles (Pack) or of singles.
template <int D, bool Odd, class Directions, class P>
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
    const std::size_t bonds = bonds_.end.empty() ? 0 : static_cast<std::size_t>(*std::max_element(bonds_.end.begin(), bonds_.end.end()));
    free_.assign(bonds + width, Number(0));
    volume_unit_ = power_of_two(std::pow(body_.spacing(), D));
    held_.assign(body_.stride(), 0);
    for (AlignedVector<Four>* rows : {&direction_, &image_, &step_, &pull_}) rows->assign(body_.stride() * rows_of_point, Four{});
    curvature_ = make();
    shift_ = first_multiplier_shift;
    evaluate(Bonds::all);
    set_blocks();
    descend();
    evaluate(Bonds::moving);
    if (most_products() >= many_products) approach();
  }

  int iterations() const noexcept { return iterations_; }
  /// f of a pack of bonds between any points that are asked, or are ghosts or images of such.
  Pack factors(std::size_t p, std::int64_t bond, const std::int32_t* far) const noexcept {
    Pack phi[even_moments<D>], psi[odd_moments<D>];
    directions_(p, bond, far, phi, psi);
    return bounded(value(p, far, phi, psi));
  }
  /// Error of the moments of a point that is asked, the root of the sum of their squares: the same however the axes are turned.
  double error(std::size_t p) const noexcept {
    return norm(p, [&](int k) { return rest_.component(k)[p]; });
  }

 private:
  using Number = typename LanesOf<P>::Number;
  using Four = typename LanesOf<P>::Four;
  static constexpr int width = LanesOf<P>::width, parts = LanesOf<P>::parts;
  static constexpr bool exact = std::is_same_v<P, Pack>;
  static constexpr int most_outer = 12, sure_outer = Odd ? most_outer : 1, most_rounds = 15, first_steps = 25, many_products = 6000, most_of_a_solve = 1500;
  enum class Bonds { all, moving };
  /// Errors below this are rounding.
  static constexpr double rounding_error = 2e-13;
  /// Multipliers of a point side by side, as loops over bonds want them.
  static constexpr std::size_t rows_of_point = (static_cast<std::size_t>(moments) + 3) / 4;
  static constexpr int columns = 4 * static_cast<int>(rows_of_point);

  Field make() const { return body_.make_field(moments); }
  /// Of values of all moments of a point, times its volume.
  template <class Of>
  double norm(std::size_t p, const Of& of) const noexcept {
    double squares = 0;
    for (int k = 0; k < moments; ++k) squares += of(k) * of(k);
    return std::sqrt(squares) / body_.volume(p);
  }
  /// f of 1 + y.
  template <class Q>
  [[gnu::always_inline]] static Q bounded(Q y) noexcept {
    using Lane = typename LanesOf<Q>::Number;
    return min(Q(Lane(most_factor)), max(Q(Lane(least_factor)), Q(Lane(1)) + y));
  }
  bool asked(std::size_t p, int k) const noexcept { return k < even || bonds_.inside[p]; }
  /// Numbers that a product passes.
  double work() const noexcept { return static_cast<double>(moments) * static_cast<double>(count_); }
  /// Steps of the descent: as many as take about a second, more on large clouds, for which fewer would leave much.
  int most_steps() const noexcept { return static_cast<int>(std::max(std::clamp(1.2e10 / work(), 50.0, 100.0), std::min(5e8 / work(), 400.0))); }
  /// Products for all: small clouds come to rounding.
  int most_products() const noexcept { return static_cast<int>(std::min(3e9 / work(), 3.0 * many_products)); }
  int left() const noexcept { return std::max(0, most_products() - iterations_); }
  /// Sum of term(k) over the points that are asked, in any order.
  template <class Term>
  double total(const Term& term) const { return total_over_ranks(exact_sum(bonds_.points.size(), term)); }

  /// Values of points -> their ghosts and images, as these are mirrored.
  void show(FieldView x) const {
    if (copies_.copy) copies_.copy(x);
    if (copies_.mirrored.empty()) return;
    static const MomentParity<D> parity;
    bool turns[moments][D];
    for (int a = 0; a < D; ++a) {
      for (int k = 0; k < even; ++k) turns[k][a] = parity.even[k][a];
      for (int k = 0; k < odd; ++k) turns[even + k][a] = parity.odd[k][a];
    }
    for (const std::int32_t p : body_.internal())
      for (int a = 0; a < D; ++a) {
        const std::int8_t sign = copies_.mirrored[static_cast<std::size_t>(p)][static_cast<std::size_t>(a)];
        if (sign > 0) continue;
        for (int k = 0; k < moments; ++k)
          if (sign == 0 || turns[k][a]) x.component(k)[p] *= sign;
      }
  }

  /// Newton's method inside of the method of multipliers.
  void approach() {
    centre_ = make();
    double best = typical_error();
    Field found = x_;
    for (int outer = 0; outer < most_outer; ++outer) {
      shift_ = later_multiplier_shift;
      std::copy_n(x_.data(), x_.size(), centre_.data());
      for (const std::int32_t p : bonds_.points)
        for (int k = 0; k < moments && held_[static_cast<std::size_t>(p)]; ++k) centre_.component(k)[p] = 0;
      if (!minimise()) break;
      const double error = typical_error();
      if (!(error < 1.01 * best)) break;   // where errors stay as they are, rounding does not decide
      if (!(largest_error() > rounding_error)) return;
      best = std::min(best, error);
      // Where some points do not come to rounding, how many steps more can be made is for rounding to say: on lattices one is made anyway, on clouds points inside come to
      // rounding by as many as there are.
      if (outer < sure_outer) std::copy_n(x_.data(), x_.size(), found.data());
    }
    std::copy_n(found.data(), found.size(), x_.data());
    evaluate(Bonds::moving);
  }

  // Doubles.
  double multiplier(std::size_t p, int k) const noexcept { return of_points_[p * rows_of_point + static_cast<std::size_t>(k) / 4][k % 4]; }
  /// (lambda_i + lambda_j) . phi + (mu_i - mu_j) . psi
  template <class Phi, class Psi>
  Pack value(std::size_t p, const std::int32_t* far, const Phi& phi, const Psi& psi) const noexcept {
    Pack sum(0.0);
    PERIKIT_UNROLL for (std::size_t r = 0; r < rows_of_point; ++r) {
      const RowColumns others = RowColumns::load(of_points_.data() + r, far, rows_of_point);
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
  template <class Phi, class Psi>
  Pack own_value(std::size_t p, const Phi& phi, const Psi& psi) const noexcept {
    Pack sum(0.0);
    for (int k = 0; k < even; ++k) sum += Pack(multiplier(p, k)) * phi[k];
    for (int k = 0; k < odd; ++k) sum += Pack(multiplier(p, even + k)) * psi[k];
    return sum;
  }
  /// visit(bond, far, n, at) for the bonds of point k, `at_once` at a time, of which there are n, from number `at` of the point on. Of packs of singles lanes beyond may be bonds of the next point.
  template <int at_once, class Visit>
  [[gnu::always_inline]] void each_pack(std::size_t k, const Visit& visit) const {
    std::int32_t far[at_once];
    for (std::int64_t b = bonds_.begin[k]; b < bonds_.end[k]; b += at_once) {
      const int n = static_cast<int>(std::min<std::int64_t>(at_once, bonds_.end[k] - b)), at = static_cast<int>(b - bonds_.begin[k]);
      if (!exact && at_once == width && b + width <= static_cast<std::int64_t>(free_.size()) - width) {
        visit(b, bonds_.far + b, n, at);
        continue;
      }
      std::copy_n(bonds_.far + b, n, far);
      std::fill(far + n, far + at_once, far[0]);
      visit(b, far, n, at);
    }
  }
  /// Of the sums of lanes, for bonds from number `at` of a point on.
  static constexpr std::size_t part_of(int at) noexcept { return static_cast<std::size_t>(at / width % parts); }
  /// Of four columns of sums.
  template <std::size_t size>
  static Four total_of(const P (&sums)[static_cast<std::size_t>(parts)][size], std::size_t first) noexcept {
    P four[static_cast<std::size_t>(parts)][4];
    for (std::size_t part = 0; part < parts; ++part)
      for (std::size_t c = 0; c < 4; ++c) four[part][c] = sums[part][first + c];
    return sums_of_lanes(four);
  }

  /// rest_ <- -V R(x_) and value_ <- the function whose derivative V R is; notes which factors move.
  void evaluate(Bonds bonds) {
    const Field* shown = &x_;
    Field copy;
    if (copies_.copy) {
      copy = x_;
      show(copy);
      shown = &copy;
    }
    of_points_.resize(body_.stride() * rows_of_point);
    over_blocks(body_.stride(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        for (int k = 0; k < moments; ++k) of_points_[p * rows_of_point + static_cast<std::size_t>(k) / 4][k % 4] = shown->component(k)[p];
    });
    value_ = total([&](std::size_t k) {
      const auto p = static_cast<std::size_t>(bonds_.points[k]);
      const double volume = body_.volume(p), relative = volume / volume_unit_;
      Pack phi[even_moments<D>], psi[odd_moments<D>];
      EightSums sums[static_cast<std::size_t>(moments)], values;
      each_pack<pack_width>(k, [&](std::int64_t bond, const std::int32_t* far, int n, int at) {
        directions_(p, bond, far, phi, psi);
        const Pack y = value(p, far, phi, psi), w = keep(first_lanes(n), Pack::load(bonds_.weight + bond)), floor(least_factor), ceiling(most_factor);
        const Pack known = bonds_.known ? Pack::load(bonds_.known + bond) : Pack(0.0), found = bounded(y), f = select(known > Pack(0.0), known, found);
        const Pack moves = Pack(relative) * select((((found > floor) & (found < ceiling)) | (bonds == Bonds::all)) & (known <= Pack(0.0)), w, Pack(0.0));
        for (int l = 0; l < n; ++l) free_[static_cast<std::size_t>(bond + l)] = static_cast<Number>(moves[l]);
        const Pack weighted = w * f;
        PERIKIT_UNROLL for (int c = 0; c < even; ++c) sums[c].at(at) += weighted * phi[c];
        PERIKIT_UNROLL for (int c = 0; c < odd; ++c) sums[even + c].at(at) += weighted * psi[c];
        // Half of w H(y), H' = f, for bonds whose other half the other end has.
        const Pack moving = y + Pack(0.5) * (y * y), over = found - Pack(1.0), resting = found * y - Pack(0.5) * (over * over);
        const Pack half = Pack(0.5) * select((found > floor) & (found < ceiling), moving, resting);
        values.at(at) += w * (bonds_.known ? select(known > Pack(0.0), known * own_value(p, phi, psi), half) : half);
      });
      for (int c = 0; c < moments; ++c) {
        const double moment = sums[c].total() - (c == 0 ? 1 : 0);
        rest_.component(c)[p] = asked(p, c) ? -volume * moment : 0.0;
      }
      return volume * (values.total() - x_.component(0)[p]);
    });
  }

  double shift(std::size_t p, int k) const noexcept { return (held_[p] ? first_multiplier_shift : shift_) * curvature_.component(k)[p]; }
  double pull(std::size_t p, int k) const noexcept { return shift(p, k) * (x_.component(k)[p] - centre_.component(k)[p]); }
  /// -V (R + shift S (x_ - x_0))
  double pulled(std::size_t p, int k) const noexcept { return asked(p, k) ? rest_.component(k)[p] - body_.volume(p) * pull(p, k) : 0.0; }

  /// The convex function of x whose derivative is V (R + shift S (x - x_0)), from x_ on.
  double merit() const {
    return value_ + total([&](std::size_t i) {
      const auto p = static_cast<std::size_t>(bonds_.points[i]);
      double sum = 0;
      for (int k = 0; k < moments; ++k) sum += 0.5 * pull(p, k) * (x_.component(k)[p] - centre_.component(k)[p]);
      return body_.volume(p) * sum;
    });
  }
  /// Whether it has come to rounding, where it does not depend on the order of points but for rounding.
  bool minimise() {
    set_pull();
    if (since_blocks_ < iterations_) set_blocks();
    double before = merit(), last = std::numeric_limits<double>::infinity();
    for (int round = 0; round < most_rounds; ++round) {
      const double error = largest([&](std::size_t p) { return norm(p, [&](int k) { return pulled(p, k); }); });
      if (error <= rounding_error || (error < 1e-9 && error > 0.5 * last)) return true;
      if (left() == 0) break;
      last = error;
      if (iterations_ > since_blocks_ + 20) set_blocks();
      const double unit = power_of_two(error);
      if (!solve(unit, std::clamp(error, exact ? 1e-8 : 1e-3, 0.1))) break;   // it would go on for long
      const double slope = unit * total([&](std::size_t i) {
        const auto p = static_cast<std::size_t>(bonds_.points[i]);
        double sum = 0;
        for (int k = 0; k < moments; ++k) sum += pulled(p, k) * static_cast<double>(single(step_, p, k));
        return sum;
      });
      if (!(slope > 0)) return error < 1e-9;
      double length = 1, moved = 0;
      for (int halving = 0; halving < 12; ++halving, length *= 0.5) {
        move(unit * (length - moved));
        moved = length;
        evaluate(Bonds::moving);
        const double after = merit();
        if (after <= before - 1e-4 * length * slope + 1e-14 * std::abs(before)) {
          before = after;
          break;
        }
      }
    }
    return false;
  }
  void move(double length) {
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      for (int k = 0; k < moments; ++k)
        for (std::size_t i = first; i < last; ++i) {
          const auto p = static_cast<std::size_t>(bonds_.points[i]);
          x_.component(k)[p] += length * static_cast<double>(single(step_, p, k));
        }
    });
  }
  template <class Of>
  double largest(const Of& of) const {
    double most = 0;
    for (const std::int32_t p : bonds_.points) most = std::max(most, of(static_cast<std::size_t>(p)));
    return communicator().largest(most);
  }
  /// Of the points that are not held.
  double largest_error() const {
    return largest([&](std::size_t p) { return held_[p] ? 0.0 : error(p); });
  }
  /// Its root mean square.
  double typical_error() const {
    const double squares = total([&](std::size_t i) {
      const auto p = static_cast<std::size_t>(bonds_.points[i]);
      const double own = held_[p] ? 0.0 : error(p);
      return own * own;
    });
    return std::sqrt(squares);
  }
  /// Points whose moments are still off by so much cannot have them: they stay near x_0 = 0.
  void hold_points() {
    take_step();
    evaluate(Bonds::all);
    shift_ = 0;
    over_points([&](std::size_t p) {
      held_[p] = error(p) > first_allowed;
    });
    set_pull();   // the blocks may keep what they have of it: it is next to nothing
  }

  // Singles. Volumes are relative to volume_unit_.
  Number& single(AlignedVector<Four>& rows, std::size_t p, int k) const noexcept { return reinterpret_cast<Number*>(rows.data())[p * columns + static_cast<std::size_t>(k)]; }
  Number single(const AlignedVector<Four>& rows, std::size_t p, int k) const noexcept { return reinterpret_cast<const Number*>(rows.data())[p * columns + static_cast<std::size_t>(k)]; }

  using Phi = P[even_moments<D>];
  using Psi = P[odd_moments<D>];
  static constexpr std::size_t entries = static_cast<std::size_t>(moments) * (static_cast<std::size_t>(moments) + 1) / 2;
  /// Of the lower triangle of a block, row by row.
  static constexpr std::size_t entry(int a, int b) noexcept { return a < b ? entry(b, a) : static_cast<std::size_t>(a * (a + 1) / 2 + b); }

  void set_pull() {
    over_points([&](std::size_t p) {
      for (int k = 0; k < moments; ++k) set_pull(p, k);
    });
  }
  void set_pull(std::size_t p, int k) noexcept { single(pull_, p, k) = static_cast<Number>(body_.volume(p) / volume_unit_ * shift(p, k)); }
  /// The inverses of the blocks on the diagonal, which belong to points; for the first time S, too, of all factors that are to be found.
  void set_blocks() {
    const bool initial = blocks_.empty();
    since_blocks_ = iterations_;
    blocks_.resize((bonds_.points.size() + width - 1) / width * entries * width);
    over_groups([&](std::size_t k) { set_block(k / width, initial); });
  }
  /// Of as many points as a pack has lanes.
  void set_block(std::size_t group, bool initial) {
    Number* const block = blocks_.data() + group * entries * width;
    const auto at = [&](std::size_t e, std::size_t l) -> Number& { return block[e * width + l]; };
    for (std::size_t l = 0; l < width; ++l) {
      const std::size_t k = group * width + l;
      if (k >= bonds_.points.size()) {
        for (std::size_t e = 0; e < entries; ++e) at(e, l) = 0;
        for (int a = 0; a < moments; ++a) at(entry(a, a), l) = 1;
        continue;
      }
      const auto p = static_cast<std::size_t>(bonds_.points[k]);
      P sums[static_cast<std::size_t>(parts)][(entries + 3) / 4 * 4] = {};
      each_pack<width>(k, [&](std::int64_t bond, const std::int32_t* far, int n, int first) {
        Phi phi;
        Psi psi;
        directions_(p, bond, far, phi, psi);
        const P w = keep_first(n, P::load(free_.data() + bond));
        for (int a = 0; a < moments; ++a) {
          const P weighted = w * (a < even ? phi[a] : psi[a - even]);
          for (int b = 0; b <= a; ++b) sums[part_of(first)][entry(a, b)] = multiply_add(weighted, b < even ? phi[b] : psi[b - even], sums[part_of(first)][entry(a, b)]);
        }
      });
      for (std::size_t e = 0; e < entries; e += 4) {
        const Four four = total_of(sums, e);
        for (std::size_t i = 0; i < 4 && e + i < entries; ++i) at(e + i, l) = four[i];
      }
      // Means over all directions of a polynomial: the same however the axes are turned.
      Number means[2] = {0, 0};
      for (int a = 0; a < moments; ++a) means[a < even ? 0 : 1] += at(entry(a, a), l) / Number(a < even ? even : odd);
      const Number most = std::max(means[0], means[1]);
      for (int a = 0; a < moments; ++a) {
        if (initial) {
          curvature_.component(a)[p] = 1e-300 + static_cast<double>(means[a < even ? 0 : 1]) * volume_unit_ / body_.volume(p);
          set_pull(p, a);
        }
        // A polynomial that vanishes along all these bonds has no curvature, and single precision has to do for the inverse.
        at(entry(a, a), l) += single(pull_, p, a) + Number(1e-3) * most + Number(1e-30);
        if (asked(p, a)) continue;
        for (int b = 0; b < moments; ++b) at(entry(a, b), l) = a == b ? Number(1) : Number(0);
      }
    }
    // Sweeps: -A^-1 takes the place of A.
    P A[entries];
    for (std::size_t e = 0; e < entries; ++e) A[e] = P::load(block + e * width);
    for (int k = 0; k < moments; ++k) {
      const P inverse = P(Number(1)) / A[entry(k, k)];
      P column[static_cast<std::size_t>(moments)];
      for (int a = 0; a < moments; ++a) column[a] = A[entry(a, k)];
      for (int a = 0; a < moments; ++a) {
        if (a == k) continue;
        const P scaled = P(Number(-1)) * column[a] * inverse;
        for (int b = 0; b <= a; ++b)
          if (b != k) A[entry(a, b)] = multiply_add(scaled, column[b], A[entry(a, b)]);
      }
      for (int a = 0; a < moments; ++a) A[entry(a, k)] = a == k ? P(Number(-1)) * inverse : column[a] * inverse;
    }
    for (std::size_t e = 0; e < entries; ++e) (P(Number(-1)) * A[e]).store(block + e * width);
    for (std::size_t l = 0; l < width && group * width + l < bonds_.points.size(); ++l)
      for (int a = 0; a < moments; ++a)
        if (!asked(static_cast<std::size_t>(bonds_.points[group * width + l]), a)) at(entry(a, a), l) = 0;
  }

  /// step_ <- about 1/unit times A^-1 of what is pulled, A its derivative for the factors that move, until the residual has fallen by so much in the norm of the preconditioner: whether it has.
  bool solve(double unit, double reduction) {
    over_points([&](std::size_t p) {
      for (int k = 0; k < moments; ++k) single(residual_, p, k) = static_cast<Number>(pulled(p, k) / (volume_unit_ * unit)), single(step_, p, k) = 0;
    });
    double product = precondition();
    const double start = product;
    over_points([&](std::size_t p) {
      for (std::size_t r = p * rows_of_point; r < (p + 1) * rows_of_point; ++r) direction_[r] = image_[r];
    });
    for (int k = 0; k < most_of_a_solve && left() > 0; ++k) {
      show_direction();
      ++iterations_;
      const double curvature = total([&](std::size_t k) { return apply(k); });
      if (!(curvature > 0)) return true;
      const auto length = static_cast<Number>(product / curvature);
      over_points([&](std::size_t p) {
        for (std::size_t r = p * rows_of_point; r < (p + 1) * rows_of_point; ++r) {
          step_[r] += length * direction_[r];
          residual_[r] -= length * image_[r];
        }
      });
      const double next = precondition();
      if (!(next > reduction * reduction * start)) return true;
      const auto share = static_cast<Number>(next / product);
      over_points([&](std::size_t p) {
        for (std::size_t r = p * rows_of_point; r < (p + 1) * rows_of_point; ++r) direction_[r] = image_[r] + share * direction_[r];
      });
      product = next;
    }
    return false;
  }
  /// Accelerated descent from 0 on [Nesterov, Soviet Math. Dokl. 27 (1983) 372; restarts of O'Donoghue, Candes, Found. Comput. Math. 15 (2015) 715]: R has no derivative where factors come to their floor, and
  /// linearised it leads astray as long as many do. In the norm of the blocks no curvature is above 2, as each bond has two ends, and steps of 1/1.5 are stable with any momentum where 2 is the largest.
  void descend() {
    residual_.assign(body_.stride() * rows_of_point, Four{});
    // What of R does not depend on x: -e_0, and bonds with known factors.
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const auto p = static_cast<std::size_t>(bonds_.points[i]);
        apply<true>(i);
        for (int k = 0; k < moments; ++k) single(residual_, p, k) = static_cast<Number>(-rest_.component(k)[p] / volume_unit_ - static_cast<double>(single(image_, p, k)));
      }
    });
    double momentum = 1;
    for (int step = 0; step < most_steps(); ++step, ++iterations_) {
      if (step == first_steps) hold_points();
      show_direction();
      const double next = 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum));
      const auto share = static_cast<Number>((momentum - 1) / next);
      over_groups([&](std::size_t k) { step_group(k, share); });
      const double along = total([&](std::size_t k) { return products_[k]; });
      std::swap(direction_, image_);
      momentum = along < 0 ? 1 : next;
    }
    take_step();
  }
  /// x_ <- step_
  void take_step() {
    over_points([&](std::size_t p) {
      for (int k = 0; k < moments; ++k) x_.component(k)[p] = static_cast<double>(single(step_, p, k));
    });
  }
  /// A step from direction_ at as many points as a pack has lanes: step_ <- x, image_ <- x + share (x - x before), products_ <- those of the step and of what drives it.
  void step_group(std::size_t k, Number share) {
    const std::size_t n = std::min<std::size_t>(width, bonds_.points.size() - k);
    std::int32_t at[width];
    for (std::size_t l = 0; l < width; ++l) at[l] = bonds_.points[k + std::min(l, n - 1)];
    alignas(64) Four rows[width * rows_of_point];
    std::int32_t place[width];
    for (std::size_t l = 0; l < width; ++l) {
      place[l] = static_cast<std::int32_t>(std::min(l, n - 1));
      if (l >= n) continue;
      apply<true>(k + l);
      const std::size_t row = static_cast<std::size_t>(at[l]) * rows_of_point;
      for (std::size_t r = 0; r < rows_of_point; ++r) rows[l * rows_of_point + r] = image_[row + r] + residual_[row + r];
    }
    P r[columns], z[columns];
    for (std::size_t row = 0; row < rows_of_point; ++row) load_columns(rows + row, place, rows_of_point, *reinterpret_cast<P(*)[4]>(r + 4 * row));
    multiply_block(k, r, z);
    store_rows(z, n, rows);
    for (std::size_t l = 0; l < n; ++l) {
      double& product = products_[k + l] = 0;
      for (std::size_t row = 0; row < rows_of_point; ++row) {
        const std::size_t place_of = static_cast<std::size_t>(at[l]) * rows_of_point + row;
        const Four x = direction_[place_of] - (Number(1 / 1.5)) * rows[l * rows_of_point + row], moved = x - step_[place_of];
        for (int c = 0; c < 4; ++c) product -= static_cast<double>(r[4 * row + static_cast<std::size_t>(c)][static_cast<int>(l)]) * static_cast<double>(moved[c]);
        step_[place_of] = x;
        image_[place_of] = x + share * moved;
      }
    }
  }
  void multiply_block(std::size_t k, const P (&r)[columns], P (&z)[columns]) const noexcept {
    for (P& component : z) component = P(Number(0));
    const Number* block = blocks_.data() + k * entries;
    for (int a = 0; a < moments; ++a)
      for (int b = 0; b <= a; ++b, block += width) {
        const P entry = P::load(block);
        z[a] = multiply_add(entry, r[b], z[a]);
        if (b < a) z[b] = multiply_add(entry, r[a], z[b]);
      }
  }
  /// Lanes -> rows of as many points, side by side.
  static void store_rows(const P (&z)[columns], std::size_t n, Four* rows) noexcept {
    alignas(64) Number lanes[columns][width];
    for (int c = 0; c < columns; ++c) z[c].store(lanes[c]);
    for (std::size_t l = 0; l < n; ++l)
      for (std::size_t row = 0; row < rows_of_point; ++row)
        for (std::size_t c = 0; c < 4; ++c) rows[l * rows_of_point + row][c] = lanes[4 * row + c][l];
  }
  /// visit(k) of the first of as many points as a pack has lanes.
  template <class Visit>
  void over_groups(const Visit& visit) {
    products_.resize(bonds_.points.size());
    const std::size_t groups = (bonds_.points.size() + width - 1) / width;
    parallel_for((groups + 7) / 8, [&](std::size_t eight) {
      for (std::size_t group = 8 * eight; group < std::min(groups, 8 * eight + 8); ++group) visit(group * width);
    }, {}, Sharing::keep);
  }
  template <class Visit>
  void over_points(const Visit& visit) const {
    over_blocks(bonds_.points.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) visit(static_cast<std::size_t>(bonds_.points[k]));
    });
  }
  /// image_ <- A direction_ at point k; their product there. whole: not A, but what is asked of moments, of all bonds with factors to be found.
  template <bool whole = false>
  double apply(std::size_t k) {
    const auto p = static_cast<std::size_t>(bonds_.points[k]);
    const Four* const own = direction_.data() + p * rows_of_point;
    P sums[static_cast<std::size_t>(parts)][static_cast<std::size_t>(columns)] = {};
    each_pack<width>(k, [&](std::int64_t bond, const std::int32_t* far, int n, int first) {
      Phi phi;
      Psi psi;
      directions_(p, bond, far, phi, psi);
      P y(Number(0)), others[4];
      PERIKIT_UNROLL for (std::size_t r = 0; r < rows_of_point; ++r) {
        load_columns(direction_.data() + r, far, rows_of_point, others);
        PERIKIT_UNROLL for (int c = 0; c < 4; ++c) {
          const int m = 4 * static_cast<int>(r) + c;
          if (m >= moments) break;
          y = m < even ? multiply_add(P(own[r][c]) + others[c], phi[m], y) : multiply_add(P(own[r][c]) - others[c], psi[m - even], y);
        }
      }
      const P w = keep_first(n, P::load(free_.data() + bond));
      y = whole ? w * bounded(y) : w * y;
      PERIKIT_UNROLL for (int c = 0; c < even; ++c) sums[part_of(first)][c] = multiply_add(y, phi[c], sums[part_of(first)][c]);
      PERIKIT_UNROLL for (int c = 0; c < odd; ++c) sums[part_of(first)][even + c] = multiply_add(y, psi[c], sums[part_of(first)][even + c]);
    });
    double product = 0;
    for (std::size_t r = 0; r < rows_of_point; ++r) {
      const Four image = total_of(sums, 4 * r) + pull_[p * rows_of_point + r] * own[r];
      image_[p * rows_of_point + r] = image;
      for (int c = 0; c < 4; ++c) product += static_cast<double>(own[r][c]) * static_cast<double>(image[c]);
    }
    return product;
  }
  /// image_ <- P residual_; their product.
  double precondition() {
    over_groups([&](std::size_t k) {
      std::int32_t at[width];
      const std::size_t n = std::min<std::size_t>(width, bonds_.points.size() - k);
      for (std::size_t l = 0; l < width; ++l) at[l] = bonds_.points[k + std::min(l, n - 1)];
      P r[columns], z[columns];
      for (std::size_t row = 0; row < rows_of_point; ++row) load_columns(residual_.data() + row, at, rows_of_point, *reinterpret_cast<P(*)[4]>(r + 4 * row));
      multiply_block(k, r, z);
      for (std::size_t l = 0; l < n; ++l) {
        double& product = products_[k + l] = 0;
        for (int c = 0; c < moments; ++c) product += static_cast<double>(r[c][static_cast<int>(l)]) * static_cast<double>(z[c][static_cast<int>(l)]);
      }
      Four rows[width * rows_of_point];
      store_rows(z, n, rows);
      for (std::size_t l = 0; l < n; ++l) std::copy_n(rows + l * rows_of_point, rows_of_point, image_.data() + static_cast<std::size_t>(at[l]) * rows_of_point);
    });
    return total([&](std::size_t k) { return products_[k]; });
  }
  /// What ghosts and images have of direction_.
  void show_direction() {
    if (!copies_.copy) return;
    Field shown = make();
    for (std::size_t p = 0; p < body_.stride(); ++p)
      for (int k = 0; k < moments; ++k) shown.component(k)[p] = static_cast<double>(single(direction_, p, k));
    show(shown);
    for (const std::int32_t i : body_.internal())
      for (int k = 0; k < moments; ++k) single(direction_, static_cast<std::size_t>(i), k) = static_cast<Number>(shown.component(k)[i]);
  }

  const Body& body_;
  const MomentBonds& bonds_;
  const PointCopies& copies_;
  Directions directions_;
  Field x_, centre_, rest_, curvature_;   ///< (lambda, mu); x_0; -V R; S
  AlignedVector<Row> of_points_;          ///< x_, of ghosts and images too
  double value_ = 0;                      ///< of the function whose derivative V R is
  AlignedVector<Number> free_;             ///< V w of the bonds whose factors move, 0 of the others
  AlignedVector<Four> direction_, image_, residual_, step_, pull_;   ///< of conjugate gradients, side by side; V shift S
  AlignedVector<Number> blocks_;           ///< inverses by as many points as a pack has, entry by entry
  std::vector<double> products_;          ///< by point that is asked
  std::vector<std::uint8_t> held_;        ///< by point
  double shift_ = 0, volume_unit_ = 1;
  std::int64_t count_ = 0;
  int iterations_ = 0, since_blocks_ = 0;
};

}  // namespace perikit
