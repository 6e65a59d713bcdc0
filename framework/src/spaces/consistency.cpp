#include "spaces/consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "perikit/core/field_operations.hpp"
#include "spaces/closed_points.hpp"

namespace perikit {

namespace {

/// Of the volume that belongs to a point.
double spacing_of(const Body& body, std::size_t p) {
  return std::pow(body.volume(p) / body.section(), 1.0 / body.dimension());
}

/// Residuals |A_k| below this, over volume and spacing, are rounding.
constexpr double tolerance = 2e-13;
constexpr int most_iterations = 4000, most_rounds = 12;
/// What is left of the unbalanced force where nobody needs to be warned.
constexpr double acceptable_residual = 1e-2;

/// The system for x = (lambda, mu), components 0 ... d - 1 and d.
class System {
 public:
  System(const SpaceParts& parts, EvaluationSpace& space, const CloudConsistency& images)
      : body_(parts.families.body()),
        space_(space),
        laws_(parts.laws),
        selective_(parts.formulation.selective()),
        images_(images),
        counted_(body_.stride(), 0),
        free_(make()),
        scale_(make()),
        shown_(body_.make_field(body_.dimension())),
        out_(shown_) {
    for (const std::int32_t p : body_.owned()) {
      counted_[static_cast<std::size_t>(p)] = 1;
      free_.component(d())[p] = 1;
    }
  }

  int d() const noexcept { return body_.dimension(); }
  Field make() const { return body_.make_field(body_.dimension() + 1); }
  const Field& free() const noexcept { return free_; }

  /// Whether lambda is not zero everywhere.
  bool let_move(const ClosedPoints& closed) {
    for (const std::int32_t p : closed.whole)
      for (int c = 0; c < d(); ++c) free_.component(c)[p] = 1;
    for (const auto& [p, along] : closed.at_surfaces)
      for (int c = 0; c < d(); ++c) free_.component(c)[p] = 1;
    along_ = closed.at_surfaces;
    return !closed.whole.empty() || !along_.empty();
  }

  /// y <- (sum_q W_q s_q g_qk, sum of W_q s_q over the q of a point), s_q = constant + tr H_q[lambda] + mu, with the weights that
  /// the space has.
  void apply(const Field& x, double constant, Field& y) { pass(x, constant, y, nullptr); }
  /// s_q by evaluation point; 0 where it has no weight.
  void factors(const Field& x, double constant, AlignedVector<double>& out) {
    out.assign(space_.factors(), 0.0);
    pass(x, constant, out_, out.data());
  }

  /// Of the preconditioner: V_i for mu, a common multiple of V_i over the square of the spacing for lambda, which a probe of the
  /// diagonal gives.
  void scale() {
    Field probe = make(), image = make();
    fill_with_noise(free_, 1, probe);
    project(probe);
    std::fill_n(probe.component(d()), body_.stride(), 0.0);
    apply(probe, 0, image);
    double sum = 0, reference = 0;
    for (const std::int32_t p : body_.owned()) {
      const auto at = static_cast<std::size_t>(p);
      const double h = spacing_of(body_, at);
      for (int c = 0; c < d(); ++c) {
        sum += probe.component(c)[p] * image.component(c)[p];
        reference += probe.component(c)[p] * probe.component(c)[p] * body_.volume(at) / (h * h);
      }
    }
    const double multiple = sum > 0 ? reference / sum : 1;
    for (const std::int32_t p : body_.owned()) {
      const auto at = static_cast<std::size_t>(p);
      const double h = spacing_of(body_, at);
      for (int c = 0; c < d(); ++c) scale_.component(c)[p] = free_.component(c)[p] * multiple * h * h / body_.volume(at);
      scale_.component(d())[p] = 1 / body_.volume(at);
    }
  }
  void precondition(const Field& r, Field& z) const {
    copy(r, z);
    mask(scale_, z);
  }

  /// Largest |A_k| over volume and spacing, and where it is.
  double largest(const Field& r, Point* where = nullptr) const {
    double most = 0;
    for (const std::int32_t p : body_.owned()) {
      const auto at = static_cast<std::size_t>(p);
      double square = 0;
      for (int c = 0; c < d(); ++c) square += r.component(c)[p] * r.component(c)[p];
      const double value = std::sqrt(square) * spacing_of(body_, at) / body_.volume(at);
      if (value <= most) continue;
      most = value;
      if (where) *where = body_.position(at);
    }
    return most;
  }

 private:
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
    mask(free_, y);
    project(y);
  }

  /// lambda of points near surfaces, along these.
  void project(Field& y) const {
    for (const auto& [p, along] : along_) {
      double value[3] = {};
      for (int a = 0; a < d(); ++a)
        for (int c = 0; c < d(); ++c) value[a] += along[static_cast<std::size_t>(3 * a + c)] * y.component(c)[p];
      for (int a = 0; a < d(); ++a) y.component(a)[p] = value[a];
    }
  }

  const Body& body_;
  EvaluationSpace& space_;
  const Laws& laws_;
  bool selective_;
  const CloudConsistency& images_;
  std::vector<std::uint8_t> counted_;
  std::vector<ClosedPoints::AtSurface> along_;
  Field free_, scale_, shown_, out_;
};

/// x with System x = b, from the x that is there; the number of iterations. Ends where |A_k| is rounding or no longer falls.
int solve(System& system, const Field& b, Field& x) {
  Field r = system.make(), z = r, direction = r, image = r;
  int iterations = 0;
  double best = 0;
  for (int restart = 0; restart < 4; ++restart) {
    system.apply(x, 0, r);
    combine(1, b, -1, r, r);
    const double now = system.largest(r);
    if (now <= tolerance || (restart > 0 && now > 0.5 * best)) break;
    best = now;
    system.precondition(r, z);
    copy(z, direction);
    double product = dot(r, z);
    const double start = product;
    int since = 0;
    for (double least = product; iterations < most_iterations && product > 0; ++iterations) {
      system.apply(direction, 0, image);
      const double curvature = dot(direction, image);
      if (!(curvature > 0)) break;
      const double step = product / curvature;
      combine(1, x, step, direction, x);
      combine(1, r, -step, image, r);
      if (system.largest(r) <= 0.5 * tolerance) break;
      system.precondition(r, z);
      const double next = dot(r, z);
      since = next < 0.5 * least ? 0 : since + 1;
      least = std::min(least, next);
      if (since > 300 || next < 1e-30 * start) break;
      combine(1, z, next / product, direction, direction);
      product = next;
    }
  }
  return iterations;
}

}  // namespace

namespace {

void find_weights(const SpaceParts& parts, EvaluationSpace& space, const ClosedPoints& closed, CloudConsistency& out) {
  System system(parts, space, out);
  const bool any = system.let_move(closed);
  out.whole = closed.whole.size();
  out.at_surfaces = closed.at_surfaces.size();
  space.set_factors({});
  system.scale();
  Field x = system.make(), none = x, b = x, volumes = x;
  system.apply(none, 1, volumes);  // sum of W_q g_qk, and of W_q
  out.before = out.after = system.largest(volumes);
  AlignedVector<double> fixed(space.factors(), 1.0), kept(space.factors(), 1.0), found;
  std::vector<std::uint8_t> bound(space.factors(), 0);
  for (out.rounds = 1; any; ++out.rounds) {
    // C W f = c with f = fixed + kept (C^T x): fixed is 1 or the bound, kept 1 or 0.
    space.set_factors(fixed);
    system.apply(none, 1, b);
    combine(-1, b, 0, b, b);
    for (const std::int32_t p : parts.families.body().owned()) b.component(system.d())[p] += volumes.component(system.d())[p];
    space.set_factors(kept);
    out.iterations += solve(system, b, x);
    system.factors(x, 0, found);
    std::size_t more = 0;
    for (std::size_t q = 0; q < found.size(); ++q) {
      if (bound[q] || out.rounds >= most_rounds || 1 + found[q] >= lowest_factor) continue;
      bound[q] = 1;
      fixed[q] = lowest_factor;
      kept[q] = 0;
      ++more;
    }
    out.bounded += more;
    if (more == 0) break;
  }
  out.factors.assign(space.factors(), 1.0);
  for (std::size_t q = 0; q < found.size(); ++q) out.factors[q] = std::max(lowest_factor, fixed[q] + kept[q] * found[q]);
  if (!out.factors.empty()) {
    const auto [low, high] = std::minmax_element(out.factors.begin(), out.factors.end());
    out.smallest = *low;
    out.largest = *high;
  }
  space.set_factors(out.factors);
  system.apply(none, 1, b);
  out.after = system.largest(b, &out.worst);
  if (any && !(out.after < out.before)) {  // the constraints contradict each other
    out.factors.assign(space.factors(), 1.0);
    out.smallest = out.largest = 1;
    out.bounded = 0;
    out.after = system.largest(volumes, &out.worst);
  }
}

}  // namespace

void find_consistency(const SpaceParts& parts, EvaluationSpace& space, CloudConsistency& out) {
  const auto begin = std::chrono::steady_clock::now();
  ClosedPoints closed = find_closed_points(parts.families, out.copy_from_sources);
  find_weights(parts, space, closed, out);
  if (out.after > acceptable_residual && !closed.at_surfaces.empty()) {
    // Evaluation points near surfaces may be too few: then the inside alone.
    CloudConsistency inside;
    inside.extend = out.extend;
    inside.fold = out.fold;
    inside.copy_from_sources = out.copy_from_sources;
    out = std::move(inside);
    closed.at_surfaces.clear();
    find_weights(parts, space, closed, out);
  }
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  out.found = true;
}

void CloudConsistency::report(ModelReport& report) const {
  report.bytes += factors.size() * sizeof(double);
  report.notes.emplace_back(
      "consistency", fmt::format("{} points balanced, {} more along surfaces; unbalanced force of a constant stress {:.2g} "
                                 "before, {:.2g} after {} iterations in {} rounds; "
                                 "w/W {:.3g} to {:.3g}, {} evaluation points bounded below; {:.2g} s",
                                 whole, at_surfaces, before, after, iterations, rounds, smallest, largest, bounded, seconds));
  if (whole + at_surfaces > 0 && after > acceptable_residual) {
    report.warnings.push_back(
        fmt::format("the cloud is not consistent: a constant stress leaves {:.2g} of stress times area unbalanced at ({:.6g}, "
                    "{:.6g}, {:.6g}); "
                    "allowed: a larger horizon, or points that lie more evenly",
                    after, worst[0], worst[1], worst[2]));
  }
  if (whole == 0)
    report.warnings.push_back(
        "consistent weights change nothing: no point is so far from all surfaces that its surroundings are whole");
}

}  // namespace perikit
