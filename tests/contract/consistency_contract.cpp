/// Clouds with consistent = true: a constant stress is in equilibrium inside, and nothing else of what a kinematics must fulfil
/// is lost.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "perikit/core/parallel.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/kit/matrices.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Kinematics that consistent clouds are for.
std::vector<Example> consistent_examples() {
  std::vector<Example> all;
  for (const Example& example : kinematics_examples()) {
    const Formulation f = formulation_of(example);
    if (f.pairs || f.force_state == ForceState::local || ((f.point || f.selective()) && f.order > 1)) continue;
    all.push_back(example);
  }
  return all;
}

BodyOptions cloud(int dimension) {
  BodyOptions body;
  body.dimension = dimension;
  body.cloud = body.consistent = true;
  body.cells = dimension == 1 ? 40 : dimension == 2 ? 15 : 12;
  body.horizon_ratio = dimension == 3 ? 2.015 : 2.515;
  return body;
}

/// One thread for the set-up of many small clouds, which a busy machine would hold up at every loop.
class OneThread {
 public:
  OneThread() { set_thread_count(1); }
  ~OneThread() { set_thread_count(threads_); }

 private:
  int threads_ = thread_count();
};

/// Distance of a place from the outermost points, without those across one axis.
double depth(const Body& body, const Point& x, int without) {
  Point low = body.position(static_cast<std::size_t>(body.owned().front())), high = low;
  for (const std::int32_t p : body.owned())
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], body.position(static_cast<std::size_t>(p))[a]);
      high[a] = std::max(high[a], body.position(static_cast<std::size_t>(p))[a]);
    }
  double least = INFINITY;
  for (int a = 0; a < body.dimension(); ++a)
    if (const auto c = static_cast<std::size_t>(a); a != without) least = std::min({least, x[c] - low[c], high[c] - x[c]});
  return least;
}

const double gradient[3][3] = {{0.1, -0.07, 0.05}, {0.03, -0.06, 0.02}, {-0.04, 0.08, 0.09}};

/// Largest force at points whose families hold no point at an open side, over stress times area, at u = G x of points and images.
double unbalanced(BodyProblem& problem, const double (&G)[3][3], int closed, int* whole) {
  const Body& body = problem.body();
  const auto d = static_cast<std::size_t>(body.dimension());
  const FieldView u = problem.state().displacement();
  set_field(body, u, [&](const Point& x) {
    Point v{};
    for (std::size_t a = 0; a < d; ++a)
      for (std::size_t b = 0; b < d; ++b) v[a] += G[a][b] * x[b];
    return v;
  });
  if (problem.images()) {  // of an image the problem has what is left beside its source
    Field mirrored = problem.make_field();
    for (int c = 0; c < u.components; ++c)
      for (const std::int32_t p : body.owned()) mirrored.component(c)[p] = u.component(c)[p];
    problem.images()->extend(mirrored);
    for (std::size_t n = body.owned().size(); n < body.points(); ++n)
      for (int c = 0; c < u.components; ++c) u.component(c)[body.internal()[n]] -= mirrored.component(c)[body.internal()[n]];
  }
  PointSamples samples;
  REQUIRE(problem.sample(samples).ok());
  const Field f = force_of(problem, u);
  double worst = 0;
  for (const std::int32_t p : body.owned()) {
    const auto at = static_cast<std::size_t>(p);
    // Points of the outer layer are moved by up to a quarter of a spacing; the cells of all others are closed.
    if (depth(body, body.position(at), closed) < body.horizon() + 0.6 * body.spacing()) continue;
    ++*whole;
    const double stress = std::abs(samples.P.component(0)[p]);
    for (std::size_t a = 0; a < d; ++a)
      worst = std::max(worst, std::abs(f.component(static_cast<int>(a))[p]) / (stress * body.volume(at) / body.spacing()));
  }
  return worst;
}

}  // namespace

TEST_CASE("kinematics: a constant stress is in equilibrium inside of a consistent cloud, and stores V psi") {
  const OneThread one;
  for (const Example& example : consistent_examples())
    for (int d = 1; d <= 3; ++d) {
      BodyOptions options = cloud(d);
      INFO(Case{example, options}.label());
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      options.consistent = false;
      const auto plain = build(scene_text(options, kinematics_table(example)));
      int whole = 0, before = 0;
      const double after = unbalanced(simulation->problem(), gradient, -1, &whole),
                   without = unbalanced(plain->problem(), gradient, -1, &before);
      REQUIRE(whole > 3);
      CHECK_MESSAGE(after <= 1e-12, "stress times area that is not balanced: ", after);
      CHECK_MESSAGE(without > 1e-3, "the cloud is consistent as it comes: ", without);
      const double energy = energy_of(simulation->problem(), simulation->problem().state().displacement()),
                   expected = energy_of(plain->problem(), plain->problem().state().displacement());
      CHECK(std::abs(energy - expected) <= 1e-11 * expected);
    }
}

TEST_CASE("kinematics: faces that are held close a consistent cloud") {
  const OneThread one;
  const double stretch[3][3] = {{0.1, 0, 0}, {0, -0.06, 0.02}, {0, 0.08, 0.09}};
  for (const Example& example : consistent_examples())
    for (int d = 1; d <= 2; ++d) {
      BodyOptions options = cloud(d);
      const char* const tangential = d == 2 ? ", \"free\"" : "";
      options.conditions = fmt::format(
          "[[boundary]]\nface = \"-x\"\ndisplacement = [0.0{0}]\n[[boundary]]\nface = \"+x\"\ndisplacement = [0.3{0}]\n",
          tangential);
      INFO(Case{example, options}.label());
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      int whole = 0;
      const double after = unbalanced(simulation->problem(), stretch, 0, &whole);
      REQUIRE(whole > 8);
      CHECK_MESSAGE(after <= 1e-12, "stress times area that is not balanced: ", after);
    }
}

TEST_CASE("kinematics: consistent clouds: force = -dE/du, tangent = dF/du, symmetric, the same assembled") {
  const OneThread one;
  for (const Example& example : consistent_examples())
    for (int d = 1; d <= 3; ++d)
      for (const bool torn : {false, true}) {
        if (torn && d == 1) continue;
        BodyOptions options = cloud(d);
        options.crack = options.two_materials = torn;
        INFO(Case{example, options}.label());
        const auto simulation = build(scene_text(options, kinematics_table(example)));
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        deform(body, problem.state().displacement(), 11, 0.02);
        const ConstFieldView u = problem.state().displacement();
        const Derivatives at = derivatives_at(problem, u, 12, 2e-3 * body.spacing());
        CHECK_MESSAGE(at.force <= 1e-7, "force is not -dE/du: off by ", at.force);
        CHECK_MESSAGE(at.tangent <= 1e-7, "tangent is not dF/du: off by ", at.tangent);
        CHECK_MESSAGE(at.asymmetry <= 1e-12, "tangent is not symmetric: off by ", at.asymmetry);
        if (d == 3) continue;
        BlockMatrix K;
        REQUIRE(problem.assemble_tangent({u, 0}, K).ok());
        const double off = test::product_error(problem, K, at.w, at.Kw);
        CHECK_MESSAGE(off <= 1e-11, "the assembled tangent is off by ", off);
      }
}

TEST_CASE("kinematics: consistent clouds are bitwise the same for one, two and three threads") {
  const int threads = thread_count();
  for (const Example& example : consistent_examples()) {
    const BodyOptions options = cloud(2);
    INFO(Case{example, options}.label());
    std::vector<Field> forces;
    for (const int count : {1, 2, 3}) {
      set_thread_count(count);  // of the set-up, too
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      deform(simulation->problem().body(), simulation->problem().state().displacement(), 51, 0.02);
      forces.push_back(force_of(simulation->problem(), simulation->problem().state().displacement()));
      if (count == 1) continue;
      CHECK_MESSAGE(difference(simulation->problem().body(), forces.front(), forces.back()) == 0, "the result is another one with ", count, " threads");
    }
    set_thread_count(threads);
  }
}
