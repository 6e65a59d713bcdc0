#include "spaces/consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "families/cloud_families.hpp"
#include "perikit/core/dimension.hpp"
#include "spaces/balance_solver.hpp"
#include "spaces/closed_points.hpp"
#include "spaces/shift.hpp"

namespace perikit {

namespace {

constexpr int most_rounds = 12;
/// Where it is still open which evaluation points are at the bound.
constexpr double rough_residual = 1e-3;
/// What is left of the unbalanced force where nobody needs to be warned.
constexpr double acceptable_residual = 1e-2;

/// The system for x = (lambda, mu), components 0 ... d - 1 and d.
class WeightSystem {
 public:
  WeightSystem(const SpaceParts& parts, EvaluationSpace& space, const ClosedPoints& closed, const CloudConsistency& images)
      : body_(parts.families.body()),
        space_(space),
        laws_(parts.laws),
        selective_(parts.formulation.selective()),
        images_(images),
        closed_(closed, body_),
        counted_(body_.stride(), 0),
        scale_(make()),
        shown_(body_.make_field(body_.dimension())),
        out_(shown_) {
    for (const std::int32_t p : body_.owned()) counted_[static_cast<std::size_t>(p)] = 1;
    set_scale();
  }

  int d() const noexcept { return body_.dimension(); }
  Field make() const { return body_.make_field(body_.dimension() + 1); }
  double largest(const Field& r, Point* where = nullptr) const { return closed_.largest(r, where); }

  /// y <- (sum_q W_q s_q g_qk, sum of W_q s_q over the q of a point), s_q = constant + tr H_q[lambda] + mu, with the weights that
  /// the space has.
  void apply(const Field& x, double constant, Field& y) { pass(x, constant, y, nullptr); }
  void apply(const Field& x, Field& y) { pass(x, 0, y, nullptr); }
  /// tr H_q[lambda] + mu by evaluation point; 0 where it has no weight.
  void factors(const Field& x, AlignedVector<double>& out) {
    out.assign(space_.factors(), 0.0);
    pass(x, 0, out_, out.data());
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
    double sum = 0, reference = 0;
    const auto unit = [&](std::int32_t p) {
      const double h = spacing_of(body_, static_cast<std::size_t>(p));
      return body_.volume(static_cast<std::size_t>(p)) / (h * h);
    };
    for (const std::int32_t p : body_.owned())
      for (int c = 0; c < d(); ++c) {
        sum += probe.component(c)[p] * image.component(c)[p];
        reference += probe.component(c)[p] * probe.component(c)[p] * unit(p);
      }
    const double multiple = sum > 0 ? reference / sum : 1;
    for (const std::int32_t p : body_.owned()) {
      for (int c = 0; c < d(); ++c) scale_.component(c)[p] = multiple / unit(p);
      scale_.component(d())[p] = 1 / body_.volume(static_cast<std::size_t>(p));
    }
  }

  void pass(const Field& x, double constant, Field& y, double* factors) {
    for (int c = 0; c < d(); ++c) std::copy_n(x.component(c), body_.stride(), shown_.component(c));
    if (images_.extend) images_.extend(shown_);
    out_.fill(0);
    double* const sums = factors ? nullptr : y.component(d());
    if (sums) std::fill_n(sums, body_.stride(), 0.0);
    const Balance balance{constant, x.component(d()), counted_.data(), sums, factors};
    const BatchWork work(laws_, Work::force, false, selective_, nullptr, &balance);
    Pass pass{work, shown_, {}, out_, nullptr, nullptr, -1, {}};
    space_.run(pass);
    if (factors) return;
    if (images_.fold) images_.fold(out_);
    for (int c = 0; c < d(); ++c)  // forces are the negative of the adjoint
      for (std::size_t p = 0; p < body_.stride(); ++p) y.component(c)[p] = -out_.component(c)[p];
    closed_.project(y);
  }

  const Body& body_;
  EvaluationSpace& space_;
  const Laws& laws_;
  bool selective_;
  const CloudConsistency& images_;
  ClosedComponents closed_;
  std::vector<std::uint8_t> counted_;
  Field scale_, shown_, out_;
};

/// C W f = c with f = fixed + kept (C^T x): fixed is 1 or the bound, kept 1 or 0.
void find_weights(const SpaceParts& parts, EvaluationSpace& space, const ClosedPoints& closed, CloudConsistency& out) {
  const Body& body = parts.families.body();
  space.set_factors({});
  WeightSystem system(parts, space, closed, out);
  Field x = system.make(), none = x, b = x, volumes = x;
  system.apply(none, 1, volumes);  // sum of W_q g_qk, and of W_q
  Balanced& result = out.weights;
  result.before = system.largest(volumes);
  AlignedVector<double> fixed(space.factors(), 1.0), kept(space.factors(), 1.0), found;
  const auto bound_more = [&] {
    std::size_t more = 0;
    for (std::size_t q = 0; q < found.size(); ++q) {
      if (kept[q] == 0 || 1 + found[q] >= lowest_factor) continue;
      fixed[q] = lowest_factor;
      kept[q] = 0;
      ++more;
    }
    out.bounded += more;
    return more;
  };
  const int most = most_iterations(body.points());
  bool rough = true;
  for (out.rounds = 1;; ++out.rounds) {
    space.set_factors(fixed);
    system.apply(none, 1, b);
    combine(-1, b, 0, b, b);
    for (const std::int32_t p : body.owned()) b.component(system.d())[p] += volumes.component(system.d())[p];
    space.set_factors(kept);
    result.iterations += solve(system, b, rough ? rough_residual : rounding_residual, most, x);
    system.factors(x, found);
    if (out.rounds < most_rounds && bound_more() > 0) continue;
    if (!rough) break;
    rough = false;
  }
  out.factors.assign(space.factors(), 1.0);
  for (std::size_t q = 0; q < found.size(); ++q) out.factors[q] = std::max(lowest_factor, fixed[q] + kept[q] * found[q]);
  space.set_factors(out.factors);
  system.apply(none, 1, b);
  result.after = system.largest(b, &result.worst);
  if (!(result.after <= result.before)) {  // the constraints contradict each other
    out.factors.assign(space.factors(), 1.0);
    out.bounded = 0;
    result.after = system.largest(volumes, &result.worst);
  }
  const auto [low, high] = std::minmax_element(out.factors.begin(), out.factors.end());
  out.smallest = *low;
  out.largest = *high;
}

void describe(const char* label, const Balanced& result, const std::string& what, ModelReport& report) {
  report.notes.emplace_back(
      label,
      fmt::format("unbalanced force of a constant stress, over stress times area: {:.2g} before, {:.2g} after {} iterations; {}",
                  result.before, result.after, result.iterations, what));
  if (result.after <= acceptable_residual) return;
  report.warnings.push_back(fmt::format(
      "the cloud is not consistent: a constant stress leaves {:.2g} of stress times area unbalanced at ({:.6g}, {:.6g}, {:.6g}); "
      "allowed: a larger horizon, or points that lie more evenly",
      result.after, result.worst[0], result.worst[1], result.worst[2]));
}

}  // namespace

void find_consistency(const SpaceParts& parts, EvaluationSpace& space, CloudConsistency& out) {
  const auto begin = std::chrono::steady_clock::now();
  ClosedPoints closed = find_closed_points(parts.families, out.copy_from_sources);
  const auto find = [&] {
    out.gradients = out.weights = {};
    out.bounded = 0;
    if (parts.formulation.point || parts.formulation.selective()) {
      out.shift = with_dimension(parts.families.body().dimension(),
                                 [&](auto d) { return find_shift<d>(*parts.families.cloud(), closed, out, out.gradients); });
      space.shift_gradients(out.shift);
    }
    if (space.factors() > 0) find_weights(parts, space, closed, out);
  };
  find();
  if (std::max(out.gradients.after, out.weights.after) > acceptable_residual && !closed.at_surfaces.empty()) {
    // Evaluation points near surfaces may be too few: then the inside alone.
    closed.at_surfaces.clear();
    find();
  }
  out.whole = closed.whole.size();
  out.at_surfaces = closed.at_surfaces.size();
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  out.found = true;
}

void CloudConsistency::report(ModelReport& report) const {
  report.bytes += factors.size() * sizeof(double) + shift.bytes();
  report.notes.emplace_back("consistency",
                            fmt::format("{} points balanced, {} more along surfaces; {:.2g} s", whole, at_surfaces, seconds));
  if (shift.components() > 0) describe("", gradients, "point gradients moved", report);
  if (!factors.empty())
    describe("", weights,
             fmt::format("weights in {} rounds, w/W {:.3g} to {:.3g}, {} evaluation points at the bound", rounds, smallest,
                         largest, bounded),
             report);
  if (whole + at_surfaces == 0)
    report.warnings.push_back("consistent = true changes nothing: every point has bonds to two sides of the body or more");
}

}  // namespace perikit
