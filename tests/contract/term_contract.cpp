/// What every point term must fulfil: force and tangent are derivatives, batches are their points, traits are true, the account of energies holds, and
/// neither threads, ranks nor stops change a bit.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>

#include "perikit/core/parallel.hpp"
#include "perikit/sdk/stable_step.hpp"
#include "setup/point_terms.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/matrices.hpp"
#include "thread_ranks.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double poison = std::numeric_limits<double>::quiet_NaN();
constexpr IntegratorTraits explicit_runs{.dynamic = true, .several_ranks = true};

/// A soft body, so that little but the term acts.
BodyOptions soft(int dimension, bool cloud) {
  BodyOptions body{.dimension = dimension, .cloud = cloud, .material = "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 0.01\npoisson_ratio = 0.25"};
  body.integrator = "type = \"verlet\"\nend_time = 1.0";
  body.cells = dimension == 1 ? 20 : dimension == 2 ? 9 : 6;
  return body;
}

std::string with_term(const Example& example, BodyOptions body, const std::string& set = "part") {
  body.conditions += fmt::format("[[term]]\ntype = \"{}\"\nset = \"{}\"\n{}\n", example.part, set, example.table);
  return scene_text(body, "type = \"conventional\"\nstabilization = \"silling\"");
}

/// check(example, dimension) for every example in the dimensions that its table allows, of which there is one.
template <class Check>
void for_every_example(Check&& check) {
  for (const Example& example : examples(Kind::term)) {
    int dimensions = 0;
    for (const int d : {1, 2, 3}) {
      INFO(example.part, " (", example.table, "), ", d, "D");
      try {
        parse_scene(with_term(example, soft(d, false)), "contract.toml", subject().registry);
      } catch (const InputErrors&) {
        continue;
      }
      ++dimensions;
      check(example, d);
    }
    CHECK_MESSAGE(dimensions > 0, example.part, " (", example.table, ") is an example in no dimension");
  }
}

/// The term of an example at some points; one number each for components of positions, displacements, velocities, directions.
class LawPoints {
 public:
  LawPoints(const Example& example, int dimension, std::size_t n, std::uint64_t seed)
      : scene_(parse_scene(with_term(example, soft(dimension, false)), "contract.toml", subject().registry)),
        part_(point_term_parts(scene_, subject().registry, explicit_runs).front()),
        traits(part_.term->traits()),
        dimension_(dimension),
        n_(n),
        stride_(padded(n) + padding) {
    Noise random(seed);
    for (auto* values : {&x, &u, &v, &w}) {
      values->assign(stride_ * static_cast<std::size_t>(dimension), poison);
      for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c)
        for (std::size_t p = 0; p < padded(n); ++p) (*values)[c * stride_ + p] = p < n ? (values == &x ? 3.0 : 0.4) * random() : (*values)[c * stride_ + n - 1];
    }
    renew(time);
  }

  /// From now on at this time.
  void renew(double t) {
    time = t;
    const auto count = static_cast<std::size_t>(traits.constants);
    constants_.assign(std::max<std::size_t>(count, 1) * stride_, poison);
    std::vector<double> one(count);
    for (std::size_t p = 0; p < padded(n_); ++p) {
      Point place{};
      for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) place[c] = x[c * stride_ + p];
      part_.constants(place, t, one.data());
      for (std::size_t k = 0; k < count; ++k) constants_[k * stride_ + p] = one[k];
    }
  }

  struct Outputs {
    AlignedVector<double> energy, force, dforce;
    Status status;
  };
  /// Of `count` points from `first` on, a multiple of `padding` unless it is one point alone.
  Outputs evaluate(std::size_t first, std::size_t count) const {
    const auto d = static_cast<std::size_t>(dimension_);
    Outputs out{AlignedVector<double>(stride_, poison), AlignedVector<double>(d * stride_, poison), AlignedVector<double>(d * stride_, poison), {}};
    AlignedVector<double> constants(constants_.size(), 0.0);
    const auto from = [&](const AlignedVector<double>& values) {
      AlignedVector<double> moved(values.size(), 0.0);
      for (std::size_t c = 0; c < values.size() / stride_; ++c)
        for (std::size_t p = 0; p < padded(count); ++p) moved[c * stride_ + p] = values[c * stride_ + std::min(first + p, first + count - 1)];
      return moved;
    };
    const AlignedVector<double> at = from(x), here = from(u), velocity = from(v), direction = from(w), k = from(constants_);
    out.status = part_.term->evaluate(dimension_, {.n = static_cast<int>(count), .stride = stride_, .time = time, .x = at.data(), .u = here.data(),
                                                   .v = traits.velocity ? velocity.data() : nullptr, .w = direction.data(), .constants = k.data(),
                                                   .constant_stride = stride_, .energy = out.energy.data(), .force = out.force.data(), .dforce = out.dforce.data()});
    return out;
  }
  Outputs evaluate() const { return evaluate(0, n_); }

  std::size_t points() const noexcept { return n_; }
  std::size_t stride() const noexcept { return stride_; }
  int dimension() const noexcept { return dimension_; }
  bool depends_on_time() const noexcept { return part_.depends_on_time(); }
  /// sum over components at a point.
  double product(const AlignedVector<double>& a, const AlignedVector<double>& b, std::size_t p) const {
    double sum = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) sum += a[c * stride_ + p] * b[c * stride_ + p];
    return sum;
  }

 private:
  Scene scene_;
  PointTermPart part_;

 public:
  TermTraits traits;
  AlignedVector<double> x, u, v, w;
  double time = 0.3;

 private:
  int dimension_;
  std::size_t n_, stride_;
  AlignedVector<double> constants_;
};

/// u + h w of all points.
LawPoints moved(const LawPoints& points, double h) {
  LawPoints other = points;
  for (std::size_t k = 0; k < other.u.size(); ++k) other.u[k] += h * points.w[k];
  return other;
}

double largest_of(const AlignedVector<double>& values, const LawPoints& points) {
  double most = 0;
  for (std::size_t c = 0; c < values.size() / points.stride(); ++c)
    for (std::size_t p = 0; p < points.points(); ++p) most = std::max(most, std::abs(values[c * points.stride() + p]));
  return most;
}

bool finite(const LawPoints::Outputs& out, const LawPoints& points) {
  for (const auto* values : {&out.energy, &out.force, &out.dforce})
    for (std::size_t c = 0; c < values->size() / points.stride(); ++c)
      for (std::size_t p = 0; p < points.points(); ++p)
        if (!std::isfinite((*values)[c * points.stride() + p])) return false;
  return true;
}

/// A run of the soft body that waves pass through, of so many steps.
std::string waves(const Example& example, int d, bool cloud, int steps, int cells = 0) {
  BodyOptions body = soft(d, cloud);
  if (cells > 0) body.cells = cells;
  body.material = "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio = 0.25";
  body.conditions = fmt::format("[initial]\nvelocity = [\"0.1*sin(x)\"{}]\n", d == 1 ? "" : d == 2 ? ", \"0.05*cos(x)\"" : ", \"0.05*cos(x)\", 0.05");
  const auto simulation = build(with_term(example, body));
  State& state = simulation->problem().state();
  double eigenvalue = largest_eigenvalue(simulation->problem(), state.displacement());
  state.time = 0.1 * steps / std::sqrt(eigenvalue);   // a term may be stiffer then
  eigenvalue = std::max(eigenvalue, largest_eigenvalue(simulation->problem(), state.displacement()));
  body.integrator = fmt::format("type = \"verlet\"\nend_time = {:.17g}\ntime_step = {:.17g}", 0.1 * steps / std::sqrt(eigenvalue), 0.1 / std::sqrt(eigenvalue));
  return with_term(example, body);
}

}  // namespace

TEST_CASE("term: force = -de/du where it is conservative, tangent = df/du") {
  constexpr double h = 1e-3, tolerance = 1e-7;
  for_every_example([&](const Example& example, int d) {
    const LawPoints points(example, d, 40, 11);
    const LawPoints::Outputs out = points.evaluate();
    REQUIRE(out.status.ok());
    REQUIRE_MESSAGE(finite(out, points), "an output is not finite");
    std::map<double, LawPoints::Outputs> at;
    for (const double s : {-2 * h, -h, h, 2 * h}) at[s] = moved(points, s).evaluate();
    const double scale = std::max({largest_of(out.force, points), largest_of(out.dforce, points), largest_of(out.energy, points)});
    for (std::size_t p = 0; p < points.points(); ++p) {
      if (points.traits.conservative) {
        const double change = test::slope_of([&](double s) { return at.at(s).energy[p]; }, h), work = points.product(out.force, points.w, p);
        CHECK_MESSAGE(std::abs(change + work) <= tolerance * scale, "de (differences): ", change, ", -f . w ", -work);
      }
      for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c) {
        const std::size_t k = c * points.stride() + p;
        const double change = test::slope_of([&](double s) { return at.at(s).force[k]; }, h);
        CHECK_MESSAGE(std::abs(change - out.dforce[k]) <= tolerance * scale, "df (differences): ", change, ", df/du . w ", out.dforce[k]);
      }
    }
  });
}

TEST_CASE("term: a batch is its points one at a time, writes all of its outputs and nothing else") {
  for_every_example([](const Example& example, int d) {
    for (const std::size_t n : {1, 5, 8, 13, 128}) {
      const LawPoints points(example, d, n, 12);
      const LawPoints::Outputs out = points.evaluate();
      REQUIRE(out.status.ok());
      CHECK_MESSAGE(finite(out, points), "an output of ", n, " points is not written");
      bool same = true, beyond = false;
      for (std::size_t p = 0; p < n; ++p) {
        const LawPoints::Outputs one = points.evaluate(p, 1);
        same = same && one.energy[0] == out.energy[p];
        for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c)
          same = same && one.force[c * points.stride()] == out.force[c * points.stride() + p] && one.dforce[c * points.stride()] == out.dforce[c * points.stride() + p];
      }
      for (const auto* values : {&out.energy, &out.force, &out.dforce})
        for (std::size_t c = 0; c < values->size() / points.stride(); ++c)
          for (std::size_t p = padded(n); p < points.stride(); ++p) beyond |= !std::isnan((*values)[c * points.stride() + p]);
      CHECK_MESSAGE(same, "a point has other values alone than among ", n);
      CHECK_MESSAGE(!beyond, "something is written beyond ", padded(n), " points");
    }
  });
}

TEST_CASE("term: what is not finite is inadmissible, and named") {
  for_every_example([](const Example& example, int d) {
    LawPoints points(example, d, 20, 13);
    points.u[6] = poison;
    const LawPoints::Outputs out = points.evaluate();
    const bool told = std::isfinite(out.energy[6]) && std::isfinite(out.force[6]) && std::isfinite(out.dforce[6]);
    CHECK_MESSAGE((out.status.inadmissible == 6 || (told && out.status.ok())), "the displacement of point 6 is no number, and ", out.status.inadmissible, " is inadmissible");
  });
}

TEST_CASE("term: traits are true") {
  for_every_example([](const Example& example, int d) {
    const LawPoints points(example, d, 40, 14);
    const LawPoints::Outputs out = points.evaluate();
    REQUIRE(out.status.ok());
    if (points.traits.constant_tangent) {
      const LawPoints::Outputs there = moved(points, 0.7).evaluate();
      double worst = 0;
      for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c)
        for (std::size_t p = 0; p < points.points(); ++p) worst = std::max(worst, std::abs(there.dforce[c * points.stride() + p] - out.dforce[c * points.stride() + p]));
      CHECK_MESSAGE(worst <= 1e-12 * largest_of(out.dforce, points), "traits.constant_tangent: the tangent changes by ", worst);
    }
    if (!points.depends_on_time()) {
      LawPoints later = points;
      later.renew(points.time + 1);
      const LawPoints::Outputs then = later.evaluate();
      bool same = true;
      for (std::size_t p = 0; p < points.points(); ++p) same = same && then.energy[p] == out.energy[p] && then.force[p] == out.force[p];
      CHECK_MESSAGE(same, "without traits.time it depends on the time");
    }
    CHECK_MESSAGE((!points.traits.dissipates || !points.traits.conservative), "what is conservative dissipates nothing");
    CHECK_MESSAGE((!points.traits.velocity || !points.traits.conservative), "a force that depends on the velocity has no energy");
    if (points.traits.dissipates) {
      // What the force takes out of a motion with velocity v and the energy does not take up.
      LawPoints along = points;
      along.w = points.v;
      std::map<double, LawPoints::Outputs> at;
      constexpr double h = 1e-3;
      for (const double s : {-2 * h, -h, h, 2 * h}) at[s] = moved(along, s).evaluate();
      const double scale = largest_of(out.force, points) + largest_of(out.energy, points);
      for (std::size_t p = 0; p < points.points(); ++p) {
        const double left = test::slope_of([&](double s) { return at.at(s).energy[p]; }, h) + points.product(out.force, points.v, p);
        CHECK_MESSAGE(left <= 1e-7 * scale, "traits.dissipates: a motion gains ", left, " W/m^3");
      }
    }
  });
}

TEST_CASE("term: in a body, the assembled tangent is the tangent action, and samples hold the energy") {
  for_every_example([](const Example& example, int d) {
    for (const bool cloud : {false, true}) {
      const auto simulation = build(with_term(example, soft(d, cloud)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      Field u = problem.make_field(), Kw = u;
      deform(body, u, 15, 0.05);
      const Field w = random_direction(problem, 16);
      const Configuration at(u, 0.3);
      REQUIRE(problem.tangent_action(at, w, Kw).ok());
      BlockMatrix K;
      REQUIRE(problem.assemble_tangent(at, K).ok());
      const double off = test::product_error(problem, K, w, Kw);
      CHECK_MESSAGE(off <= 1e-12, "assembled and applied tangent differ by ", off);
      double energy = 0, sampled = 0;
      Field f = problem.make_field();
      REQUIRE(problem.evaluate_forces(at, f, &energy).ok());
      PointSamples samples;
      REQUIRE(problem.terms().sample(at, samples).ok());
      for (const std::int32_t p : body.owned()) sampled += samples.strain_energy_density.data()[p] * body.volume(static_cast<std::size_t>(p));
      CHECK_MESSAGE(std::abs(sampled - energy) <= 1e-11 * std::abs(energy), "samples hold ", sampled, " J of ", energy);
    }
  });
}

TEST_CASE("term: the account of energies holds in an explicit run") {
  constexpr double tolerance = 5e-3;   // verlet leaves 0.1 % at a tenth of a radian a step
  for_every_example([&](const Example& example, int d) {
    const auto simulation = build(waves(example, d, false, 60));
    const Watch watch = contract::run(*simulation);
    double most = 0, off = 0;
    const auto total = [](const Energies& e) { return e.strain + e.kinetic + e.dissipated - e.external_work; };
    for (const Energies& e : watch.energies) {
      most = std::max({most, std::abs(e.strain), std::abs(e.kinetic), std::abs(e.dissipated), std::abs(e.external_work)});
      off = std::max(off, std::abs(total(e) - total(watch.energies.front())));
    }
    CHECK_MESSAGE(off <= tolerance * most, "the energies are off by ", off / most, " of the largest");
  });
}

TEST_CASE("term: bitwise the same for one, two and three threads and ranks, also where a rank has none of its points, and from a saved state") {
  for_every_example([](const Example& example, int d) {
    for (const bool cloud : {false, true}) {
      const std::string text = waves(example, d, cloud, 12, d == 1 ? 700 : d == 2 ? 16 : 6);   // ranks own whole blocks of points
      std::mutex one;
      const auto result = [&](int ranks, int threads) {
        std::map<std::int64_t, Point> displacements;
        std::vector<double> energies;
        const int before = thread_count();
        set_thread_count(threads);
        on_ranks(ranks, [&](ThreadRank&) {
          const auto simulation = build(text);
          const Watch watch = contract::run(*simulation);
          const std::scoped_lock lock(one);
          energies.clear();
          for (const Energies& e : watch.energies) energies.insert(energies.end(), {e.strain, e.kinetic, e.dissipated, e.external_work});
          const Body& body = simulation->problem().body();
          const FieldView u = simulation->problem().state().displacement();
          for (const std::int32_t p : body.owned())
            for (int c = 0; c < d; ++c) displacements[body.number(static_cast<std::size_t>(p))][static_cast<std::size_t>(c)] = u.component(c)[p];
        });
        set_thread_count(before);
        return std::pair(displacements, energies);
      };
      const auto alone = result(1, 1);
      for (const int count : {2, 3}) {
        CHECK_MESSAGE(result(1, count) == alone, "the run is another one with ", count, " threads");
        CHECK_MESSAGE(result(count, 1) == alone, "the run is another one with ", count, " ranks");
      }
      const auto whole = build(text), first = build(text), second = build(text);
      contract::run(*whole);
      contract::run(*first, 5);
      second->problem().restore(first->problem().snapshot());
      contract::run(*second);
      CHECK_MESSAGE(state(*second) == state(*whole), "the run from a saved state differs by ", difference(state(*second), state(*whole)));
    }
  });
}
