#include "cloud_balance/consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cloud_balance/balance_solver.hpp"
#include "cloud_balance/points_with_full_neighbourhood.hpp"
#include "cloud_balance/shift.hpp"
#include "core/dimension.hpp"
#include "families/cloud/cloud_families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"

namespace perikit {

namespace {

constexpr int most_rounds = 40;
/// Of the residual that a round of Newton's method begins with: what its linear system may leave.
constexpr double forcing = 0.3;
/// What is left of the unbalanced force where nobody needs to be warned.
constexpr double acceptable_residual = 1e-2;

/// f with phi'(f) = (f - 1/f)/2 = y, and its derivative.
double factor_of(double y) noexcept {
  const double root = std::sqrt(1 + y * y);
  return y < 0 ? 1 / (root - y) : root + y;
}
double slope_of(double f) noexcept { return 2 * f * f / (1 + f * f); }

std::size_t of_all_ranks(std::size_t count) {
  auto sum = static_cast<std::int64_t>(count);
  communicator().sum({&sum, 1});
  return static_cast<std::size_t>(sum);
}

/// The system for x = (lambda, mu), components 0 ... d - 1 and d.
class WeightSystem {
 public:
  WeightSystem(EvaluationSpace& space, const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond)
      : body_(parts.families.body()),
        space_(space),
        laws_(parts.laws),
        selective_(parts.formulation.selective()),
        beyond_(beyond),
        closed_(closed, body_),
        counted_(storing_points(parts)),
        owned_(body_.make_field(1)),
        scale_(make()),
        shown_(make()),
        out_(body_.make_field(body_.dimension())) {
    for (const std::int32_t p : body_.owned()) owned_.data()[p] = 1;
    set_scale();
  }

  int d() const noexcept { return body_.dimension(); }
  Field make() const { return body_.make_field(body_.dimension() + 1); }
  double largest(const Field& r, Point* where = nullptr) const { return closed_.largest(r, where); }
  std::size_t let_go(const Field& r, double above) { return closed_.let_go(r, above); }
  const ClosedPoints& closed() const noexcept { return closed_.points(); }

  /// y <- (sum_q W_q s_q g_qk, sum of W_q s_q over the q of a point), s_q = tr H_q[lambda] + mu, with the weights that the space
  /// has.
  void apply(const Field& x, Field& y) {
    copy(x, shown_);
    pass(0, &y, nullptr);
  }
  /// The same of s_q = 1.
  void apply_to_ones(Field& y) {
    shown_.fill(0);
    pass(1, &y, nullptr);
  }
  /// tr H_q[lambda] + mu by evaluation point; 0 where it has no weight.
  void factors(const Field& x, AlignedVector<double>& out) {
    out.assign(space_.factors(), 0.0);
    copy(x, shown_);
    pass(0, nullptr, out.data());
  }
  void precondition(const Field& r, Field& z) const {
    copy(r, z);
    mask(scale_, z);
  }

 private:
  /// Of the preconditioner: 1/V_i for mu, a common multiple of the square of the spacing over V_i for lambda, which a probe of
  /// the diagonal gives.
  void set_scale() {
    Field probe = make(), image = make(), everywhere = make();
    for (const std::int32_t p : body_.owned())
      for (int c = 0; c < d(); ++c) everywhere.component(c)[p] = 1;
    fill_with_noise(everywhere, 1, body_.places(), probe);
    closed_.project(probe);
    apply(probe, image);
    const auto unit = [&](std::int32_t p) {
      const double h = spacing_of(body_, static_cast<std::size_t>(p));
      return body_.volume(static_cast<std::size_t>(p)) / (h * h);
    };
    const double sum = dot(probe, image);
    for (const std::int32_t p : body_.owned())
      for (int c = 0; c < d(); ++c) image.component(c)[p] = probe.component(c)[p] * unit(p);
    const double multiple = sum > 0 ? dot(probe, image) / sum : 1;
    for (const std::int32_t p : body_.owned()) {
      for (int c = 0; c < d(); ++c) scale_.component(c)[p] = multiple / unit(p);
      scale_.component(d())[p] = 1 / body_.volume(static_cast<std::size_t>(p));
    }
  }

  /// Of x in shown_: y, or the factors.
  void pass(double constant, Field* y, double* factors) {
    const FieldView lambda{shown_.data(), body_.stride(), d()}, mu{shown_.component(d()), body_.stride(), 1};
    if (beyond_.extend) beyond_.extend(lambda);
    if (beyond_.copy_from_sources) beyond_.copy_from_sources(mu);
    out_.fill(0);
    double* const sums = y ? y->component(d()) : nullptr;
    if (sums) std::fill_n(sums, body_.stride(), 0.0);
    const Balance balance{constant, mu.data, counted_.data(), sums, factors};
    const BatchWork work(laws_, {.selective = selective_, .balance = &balance});
    Pass pass{work, lambda, {}, out_, nullptr, nullptr, -1, {}};
    space_.run(pass);
    if (!y) return;
    if (beyond_.fold) beyond_.fold(out_);
    for (int c = 0; c < d(); ++c)  // forces are the negative of the adjoint
      for (std::size_t p = 0; p < body_.stride(); ++p) y->component(c)[p] = -out_.component(c)[p];
    mask(owned_, FieldView{sums, body_.stride(), 1});
    closed_.project(*y);
  }

  const Body& body_;
  EvaluationSpace& space_;
  const Laws& laws_;
  bool selective_;
  const CloudConsistency& beyond_;
  ClosedComponents closed_;
  std::vector<std::uint8_t> counted_;
  Field owned_, scale_, shown_, out_;
};

/// Newton's method for y, f = factor_of(y), y_q = tr H_q[lambda] + mu_i: a round solves C W f' C^T dx = c - C W f for dx =
/// (lambda, mu) roughly. Where evaluation points are too few for the conditions on them, as may be near surfaces, the residual
/// no longer falls, and the points there are let go.
class WeightSearch {
 public:
  WeightSearch(const SpaceParts& parts, EvaluationSpace& space, const ClosedPoints& closed, CloudConsistency& out)
      : body_(parts.families.body()),
        space_(space),
        system_(without_factors(space), parts, closed, out),
        volumes_(body_.make_field(1)),
        rest_(system_.make()),
        effort_(effort_of_balance(parts)),
        out_(out) {
    system_.apply_to_ones(rest_);  // sum of W_q g_qk, and of W_q
    out_.weights.before = system_.largest(rest_);
    std::copy_n(rest_.component(system_.d()), volumes_.stride(), volumes_.data());
  }

  void run() {
    while (!search()) {
    }
    out_.weights.after = left(&out_.weights.worst);
    if (!(out_.weights.after <= out_.weights.before)) {  // the constraints contradict each other
      replace_factors([](double) { return 1.0; });
      out_.weights.after = left(&out_.weights.worst);
    }
    double low = 1, high = 1;
    for (const double f : out_.factors) low = std::min(low, f), high = std::max(high, f);
    out_.smallest = -communicator().largest(-low);
    out_.largest = communicator().largest(high);
    out_.at_surfaces = of_all_ranks(system_.closed().at_surfaces.size());
    out_.unbalanced = out_.whole - of_all_ranks(system_.closed().whole.size());
  }

 private:
  static EvaluationSpace& without_factors(EvaluationSpace& space) {
    space.set_factors({});
    return space;
  }

  /// rest_ <- c - C W f with the factors that the space has.
  double left(Point* where = nullptr) {
    system_.apply_to_ones(rest_);
    combine(-1, rest_, 0, rest_, rest_);
    for (const std::int32_t p : body_.owned()) rest_.component(system_.d())[p] += volumes_.data()[p];
    return system_.largest(rest_, where);
  }

  /// The points with most of rest_, which do not come to rest: those at surfaces first, all of these at the third time. How many.
  std::size_t let_go(double residual) {
    const bool surfaces = of_all_ranks(system_.closed().at_surfaces.size()) > 0;
    return system_.let_go(rest_, surfaces && ++times_ > 2 ? 0 : forcing * residual);
  }

  /// out_.factors <- of[y] of all evaluation points, y = C^T x.
  template <class Of>
  void set_factors(const Field& x, const Of& of) {
    space_.set_factors({});
    system_.factors(x, out_.factors);
    replace_factors(of);
  }
  /// The same of what is there.
  template <class Of>
  void replace_factors(const Of& of) {
    AlignedVector<double>& f = out_.factors;
    over_blocks(f.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t q = begin; q < end; ++q) f[q] = of(f[q]);
    });
    space_.set_factors(f);
  }

  /// From f = 1. False: points were let go, so that it is to be begun again. Bonds are many, and one number is held of each: f, or f' while
  /// a step is looked for, or what that changes y by. All of them follow from the sum of the steps, four numbers a point.
  bool search() {
    AlignedVector<double>& f = out_.factors;
    f.assign(space_.factors(), 1.0);
    space_.set_factors(f);
    Field x = system_.make();
    std::vector<double> residuals;
    const int before = out_.weights.iterations;
    for (out_.rounds = 1;; ++out_.rounds) {
      const double residual = residuals.emplace_back(left());
      if (out_.show_share && residual > 0 && residuals.front() > rounding_residual)
        out_.show_share(std::clamp(std::log(residuals.front() / residual) / std::log(residuals.front() / rounding_residual), 0.0, 1.0));
      const int spent = out_.weights.iterations - before;
      if (effort_.ends(residual, spent) || out_.rounds > most_rounds) return true;
      const bool stuck = residuals.size() > 3 && residual > 0.75 * residuals[residuals.size() - 4];
      if (stuck && residual <= enough_residual) return true;  // rounding
      if (stuck) return let_go(residual) == 0;
      replace_factors(slope_of);
      const BalanceEffort rest{effort_.polish - spent, effort_.most - spent};
      const Solved step = solve(system_, rest_, std::max(0.5 * rounding_residual, std::min(forcing, residual) * residual), rest);
      out_.weights.iterations += step.iterations;
      if (!step.contradiction) {
        set_factors(step.x, [](double y) { return y; });
        const double longest = largest_magnitude({f.data(), f.size(), 1});
        combine(1, x, std::min(1.0, 2 / longest), step.x, x);
      }
      set_factors(x, factor_of);
      if (step.contradiction) return true;
    }
  }

  const Body& body_;
  EvaluationSpace& space_;
  WeightSystem system_;
  Field volumes_, rest_;
  BalanceEffort effort_;
  int times_ = 0;  ///< that points at surfaces were let go
  CloudConsistency& out_;
};

void describe(const char* label, const Balanced& result, const std::string& what, ModelReport& report) {
  report.notes.emplace_back(
      label,
      fmt::format("unbalanced force of a constant stress, over stress times area: {:.2g} before, {:.2g} after {} iterations; {}",
                  result.before, result.after, result.iterations, what));
  if (result.after <= acceptable_residual) return;
  report.warnings.push_back(named("balance", fmt::format(
      "the cloud is not consistent: a constant stress leaves {:.2g} of stress times area unbalanced at ({:.6g}, {:.6g}, {:.6g}); "
      "allowed: a larger horizon, or points that lie more evenly",
      result.after, result.worst[0], result.worst[1], result.worst[2])));
}

}  // namespace

BalanceEffort effort_of_balance(const SpaceParts& parts) {
  const Formulation& formulation = parts.formulation;
  const bool own_family = formulation.weighted && formulation.parts(parts.families.body().dimension()) == 0;
  std::int64_t work = 0;  // of a product, in bonds
  for (const std::int32_t p : parts.families.body().owned()) {
    const auto bonds = static_cast<std::int64_t>(parts.families.cloud()->neighbours(static_cast<std::size_t>(p)).size());
    work += own_family ? std::max(bonds, bonds * bonds / 16) : bonds;
  }
  communicator().sum({&work, 1});
  if (!communicator().complete()) return {0, 1};  // what it takes is all that a rank without others can find out
  const auto products = [&](double of_all, double least) {
    return static_cast<int>(std::clamp(of_all / static_cast<double>(std::max<std::int64_t>(work, 1)), least, 4000.0));
  };
  return {products(1e8, 0), products(3e8, 150)};
}

std::vector<std::uint8_t> storing_points(const SpaceParts& parts) {
  const Body& body = parts.families.body();
  const auto& ids = body.material_ids();
  std::vector<std::uint8_t> stores(body.stride(), 0);
  for (std::size_t p = 0; p < body.points(); ++p) stores[p] = ids.empty() || !parts.laws.records()[ids[p]].silent;
  return stores;
}

/// Of the gradients of points, or of owners where the map is selective, then of those of parts.
template <int D>
Field find_shifts(const SpaceParts& parts, const ClosedPoints& closed, CloudConsistency& out) {
  const Formulation& formulation = parts.formulation;
  std::vector<Field> found;
  const auto take = [&](Field field, const Balanced& result) {
    found.push_back(std::move(field));
    const int iterations = out.gradients.iterations + result.iterations;
    const double before = std::max(out.gradients.before, result.before), moved = std::max(out.gradients.moved, result.moved);
    if (found.size() == 1 || result.after > out.gradients.after) out.gradients = result;
    out.gradients.iterations = iterations;
    out.gradients.before = before;
    out.gradients.moved = moved;
  };
  Balanced result;
  if (formulation.point || formulation.selective()) take(find_shift<D>(parts, closed, out, result), result);
  if (formulation.weighted && formulation.parts(D) > 0) take(find_part_shift<D>(parts, closed, out, result), result);
  if (found.size() < 2) return found.empty() ? Field() : std::move(found.front());
  Field both = parts.families.body().make_field(2 * D);
  for (int c = 0; c < 2 * D; ++c) std::copy_n(found[static_cast<std::size_t>(c / D)].component(c % D), both.stride(), both.component(c));
  return both;
}

void find_consistency(const SpaceParts& parts, EvaluationSpace& space, CloudConsistency& out) {
  const auto begin = std::chrono::steady_clock::now();
  ClosedPoints closed = find_closed_points(parts.families, out.copy_from_sources);
  const auto find = [&] {
    out.gradients = out.weights = {};
    out.whole = of_all_ranks(closed.whole.size());
    out.unbalanced = 0;
    out.factors.clear();
    out.at_surfaces = of_all_ranks(closed.at_surfaces.size());
    out.shift = with_dimension(parts.families.body().dimension(), [&](auto d) { return find_shifts<d>(parts, closed, out); });
    if (out.shift.components() > 0) space.shift_gradients(out.shift);
    if (of_all_ranks(space.factors()) > 0 && out.whole + out.at_surfaces > 0) WeightSearch(parts, space, closed, out).run();
  };
  find();
  if (std::max(out.gradients.after, out.weights.after) > acceptable_residual && of_all_ranks(closed.at_surfaces.size()) > 0) {
    // Evaluation points near surfaces may be too few: then the inside alone.
    closed.at_surfaces.clear();
    find();
  }
  out.seconds = communicator().largest(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  out.found = true;
}

void CloudConsistency::report(ModelReport& report) const {
  report.bytes += factors.size() * sizeof(double) + shift.bytes();
  report.notes.emplace_back("consistency",
                            fmt::format("{} points balanced, {} more along surfaces; {:.2g} s", whole, at_surfaces, seconds));
  if (shift.components() > 0) describe("", gradients, fmt::format("gradients moved by {:.2g} %", 100 * gradients.moved), report);
  if (!factors.empty())
    describe("", weights,
             fmt::format("weights in {} rounds, w/W {:.3g} to {:.3g}", rounds, smallest, largest),
             report);
  if (unbalanced > 0)
    report.warnings.push_back(
        named("balance", fmt::format("{} of {} points inside of the cloud have too few evaluation points around them to balance a constant stress; "
                    "allowed: more parts, a larger horizon, or points that lie more evenly",
                    unbalanced, whole)));
  if (whole + at_surfaces == 0)
    report.warnings.push_back(
        named("balance", "the cloud cannot be made consistent: every point has bonds to two sides of the body or more; allowed: more points across"));
}

}  // namespace perikit
