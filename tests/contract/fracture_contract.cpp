/// What must hold for every kinematics when bonds fail during a run: a body whose bonds have failed is the body that was built
/// without them, failed bonds never come back, both ends feel the same, energy that is released is accounted for, and a run that is
/// resumed goes on bitwise.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numeric>
#include <optional>
#include <set>

#include "tests/contract/bonds_that_fail.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/contract/reference_body.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/matrices.hpp"
#include "tests/unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Height of a plane through the whole body, between two layers of points of a lattice.
double plane_height(const Body& body) {
  double low = INFINITY, high = -INFINITY;
  for (const std::int32_t p : body.internal()) {
    const double y = body.position(static_cast<std::size_t>(p))[1];
    low = std::min(low, y);
    high = std::max(high, y);
  }
  return std::round(0.5 * (low + high) / body.spacing()) * body.spacing() + 0.013 * body.spacing();
}

/// A crack through the whole body at that height, as a scene says it.
std::string crack_text(const Body& body) {
  const double y = plane_height(body);
  if (body.dimension() == 2) return fmt::format("[[crack]]\nsegment = [[-9, {0:.17g}], [99, {0:.17g}]]\n", y);
  return fmt::format("[[crack]]\npolygon = [[-9, {0:.17g}, -9], [99, {0:.17g}, -9], [99, {0:.17g}, 99], [-9, {0:.17g}, 99]]\n", y);
}

/// Moves everything above the plane away, so that every bond across it is stretched beyond the limit and no other bond changes.
void part_at(const Body& body, FieldView u, double height) {
  set_field(body, u, [&](const Point& x) { return Point{0.0, x[1] > height ? 20 * body.spacing() : 0.0, 0.0}; });
}

struct Response {
  double energy = 0;
  Field force;
};

Response respond(BodyProblem& problem, std::uint64_t seed) {
  stretch_at_random(problem.body(), problem.state().displacement(), seed);
  Response r;
  r.force = force_of(problem, problem.state().displacement(), &r.energy);
  return r;
}

/// |K w - Kw| of the assembled tangent and the tangent action along noise, relative to Kw.
double tangent_difference(BodyProblem& problem) {
  const Field w = random_direction(problem, 21);
  Field Kw = problem.make_field();
  REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, w, Kw).ok());
  BlockMatrix K;
  REQUIRE(problem.terms().assemble({problem.state().displacement(), 0}, K).ok());
  return test::product_error(problem, K, w, Kw);
}

/// How far the slope of the energy along a random direction is from -force, relative to it.
double slope_error(BodyProblem& problem, const Response& r) {
  const Field w = random_direction(problem, 3);
  const ConstFieldView u = problem.state().displacement();
  const double slope = test::slope_of([&](double s) { return energy_of(problem, shifted(problem, u, w, s)); }, 1e-5), expected = -dot(problem.body(), r.force, w);
  return std::abs(slope - expected) / std::abs(expected);
}

/// Largest difference of sampled gradients of an affine motion from its own, fragments apart.
double affine_error(BodyProblem& problem) {
  const int d = problem.dimension();
  set_field(problem.body(), problem.state().displacement(), [&](const Point& x) {
    return d == 1 ? Point{0.1 * x[0]} : Point{0.1 * x[0] - 0.07 * x[1], 0.03 * x[0] - 0.06 * x[1], d == 3 ? 0.05 * x[2] : 0.0};
  });
  PointSamples samples;
  REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, samples).ok());
  const Field damage = problem.terms().damage();
  const double G[3][3] = {{0.1, -0.07, 0}, {0.03, -0.06, 0}, {0, 0, 0.05}};
  double worst = 0;
  for (const std::int32_t p : problem.body().internal())
    for (int a = 0; a < d && damage.data()[p] < 1; ++a)
      for (int b = 0; b < d; ++b) worst = std::max(worst, std::abs(samples.H.component(a * d + b)[p] - G[a][b]));
  return worst;
}

struct Stretched {
  std::int32_t point, far;
  double stretch;
};

/// The stretch of every pair of the body within the horizon, looked at one by one.
std::vector<Stretched> stretches(const Body& body, ConstFieldView u) {
  std::vector<Stretched> all;
  for (const std::int32_t p : body.internal())
    for (const std::int32_t q : body.internal()) {
      if (q <= p) continue;
      const Point x = body.position(static_cast<std::size_t>(p)), y = body.position(static_cast<std::size_t>(q));
      double xi2 = 0, y2 = 0;
      for (int c = 0; c < body.dimension(); ++c) {
        const double xi = y[static_cast<std::size_t>(c)] - x[static_cast<std::size_t>(c)], du = u.component(c)[q] - u.component(c)[p];
        xi2 += xi * xi;
        y2 += (xi + du) * (xi + du);
      }
      if (std::sqrt(xi2) <= body.horizon() * (1 + 1e-10)) all.push_back({p, q, std::sqrt(y2 / xi2) - 1});
    }
  return all;
}

/// A limit between two neighbours that leaves this share of the bonds whole.
double quantile(std::vector<Stretched> all, double share) {
  std::sort(all.begin(), all.end(), [](const Stretched& a, const Stretched& b) { return a.stretch < b.stretch; });
  const auto k = static_cast<std::size_t>(share * static_cast<double>(all.size()));
  return 0.5 * (all[k].stretch + all[k - 1].stretch);
}

/// `selective` knows of bonds that fail in the course of a run: what the dense reference says of this body as it is, the bonds across the
/// plane failed. Nothing where the reference does not know the kinematics.
std::optional<Response> dense_response(Simulation& simulation, double height) {
  BodyProblem& problem = simulation.problem();
  const Body& body = problem.body();
  const auto influence = subject().registry.influence(*simulation.scene().influence);
  reference::Cloud cloud = cloud_of(body, *influence);
  cloud.failed = true;
  cloud.integrity = [position = cloud.position, height](int i, int j) {
    const auto below = [&](int k) { return position[static_cast<std::size_t>(k)][1] < height; };
    return below(i) == below(j) ? 1.0 : 0.0;
  };
  auto description = description_of(*simulation.scene().kinematics);
  if (!description) return std::nullopt;
  set_cell(*simulation.scene().kinematics, body, *description);
  const reference::Operator op = reference::build(cloud, *description);
  const reference::Vector u = dense(body, problem.state().displacement()), f = reference::force(op, saint_venant_kirchhoff(), u);
  Response r{reference::energy(op, saint_venant_kirchhoff(), u), problem.make_field()};
  const auto d = static_cast<std::size_t>(problem.dimension());
  for (std::size_t i = 0; i < body.points(); ++i)
    for (std::size_t c = 0; c < d; ++c) r.force.component(static_cast<int>(c))[body.internal()[i]] = f[static_cast<Eigen::Index>(d * i + c)];
  return r;
}

}  // namespace

TEST_CASE("kinematics: a body whose bonds have failed is the body that was built without them") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d)) continue;
        if (const Formulation formulation = formulation_of(example); formulation.pairs && formulation.pair_traits.factors == BondFactorsOf::moments) continue;   // their factors take pre-cracks for surfaces
        BodyOptions options{.dimension = d, .cloud = cloud, .two_materials = !formulation_of(example).selective()};
        const auto whole = build(scene_text(options, kinematics_table(example)));
        const double height = plane_height(whole->problem().body());
        options.conditions = limit_of_stretch;
        const auto failing = build(scene_text(options, kinematics_table(example)));
        options.conditions = crack_text(whole->problem().body());
        const auto cut = build(scene_text(options, kinematics_table(example)));
        BodyProblem& problem = failing->problem();
        const Body& body = problem.body();
        // Before anything fails the criterion changes nothing.
        const Response before = respond(problem, 5), plain = respond(whole->problem(), 5);
        CHECK(difference(body, before.force, plain.force) == 0);
        CHECK(before.energy == plain.energy);
        part_at(body, problem.state().displacement(), height);
        const BondUpdate update = problem.fracture()->update({problem.state().displacement(), 0}, 0);
        CHECK(2 * update.changed == cut->problem().report().broken_bonds);
        CHECK(problem.fracture()->update({problem.state().displacement(), 0}, 0).changed == 0);
        const Response after = respond(problem, 6);
        const bool selective = formulation_of(example).selective();
        const std::optional<Response> expected = selective ? dense_response(*failing, height) : respond(cut->problem(), 6);
        if (expected) {
          CHECK(std::abs(after.energy - expected->energy) <= 1e-11 * expected->energy);
          CHECK(difference(body, after.force, expected->force) <= 1e-10 * largest(body, expected->force));
        } else {
          MESSAGE("no dense reference of kinematics '" << example.part << "'");
        }
        const Field damage = problem.terms().damage(), cut_damage = cut->problem().terms().damage();
        for (const std::int32_t p : body.internal()) CHECK(std::abs(damage.data()[p] - cut_damage.data()[p]) <= 1e-12);
        // At rest again, and closed: nothing heals.
        set_field(body, problem.state().displacement(), [](const Point&) { return Point{}; });
        CHECK(problem.fracture()->update({problem.state().displacement(), 0}, 0).changed == 0);
        CHECK(problem.families().changed().size() == update.changed);
      }
}

TEST_CASE("kinematics: released energy, momentum, symmetry and restoring of bonds that fail at random") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d)) continue;
        BodyOptions options{.dimension = d, .cloud = cloud, .two_materials = cloud == (d == 2)};
        const auto plain = build(scene_text(options, kinematics_table(example)));
        stretch_at_random(plain->problem().body(), plain->problem().state().displacement(), 11);
        const double most = quantile(stretches(plain->problem().body(), plain->problem().state().displacement()), 0.95);
        options.conditions = fmt::format(
            "[damage]\ntype = \"critical_stretch\"\nsecond_law = false\nstretch = {:.17g}\nno_fail = [\"part\"]\n", most);
        const std::string text = scene_text(options, kinematics_table(example));
        const auto simulation = build(text);
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        const auto intact = respond(problem, 11);
        const BondUpdate update = problem.fracture()->update({problem.state().displacement(), 0}, 0);
        CHECK(update.changed > 0);
        Response r = respond(problem, 11);
        CHECK(std::abs(intact.energy - r.energy - update.dissipated) <= 1e-11 * intact.energy);
        // The assembled tangent is the tangent action of the bonds that are left.
        CHECK(tangent_difference(problem) <= 1e-12);
        // Momentum; and force = -dE/du along a random direction.
        for (int c = 0; c < d; ++c) CHECK(std::abs(total(body, r.force, c)) <= 1e-12 * static_cast<double>(body.points()) * largest(body, r.force));
        CHECK(slope_error(problem, r) <= 1e-6);
        // No bond of a protected point failed, and every failed one is named once.
        const std::set<std::int32_t> safe(body.set("part").begin(), body.set("part").end());
        std::set<std::pair<std::int32_t, std::int32_t>> named;
        for (const BondChange& b : problem.families().changed()) {
          CHECK((!safe.contains(b.bond.point) && !safe.contains(b.bond.far)));
          CHECK(b.integrity == 0);
          CHECK(b.bond.point < b.bond.far);
          CHECK(named.emplace(b.bond.point, b.bond.far).second);
        }
        std::size_t expected = 0;
        for (const Stretched& b : stretches(body, problem.state().displacement())) {
          if (b.stretch <= most || safe.contains(b.point) || safe.contains(b.far)) continue;
          ++expected;
          CHECK(named.contains({b.point, b.far}));
        }
        CHECK(named.size() == expected);
        // A fresh problem that takes over the state answers bitwise the same; and one that is taken back is whole again.
        const std::vector<std::byte> saved = problem.snapshot();
        const auto other = build(text);
        const std::vector<std::byte> fresh = other->problem().snapshot();
        other->problem().restore(saved);
        const Response same = respond(other->problem(), 11);
        CHECK(same.energy == r.energy);
        CHECK(difference(body, same.force, r.force) == 0);
        other->problem().restore(fresh);
        const Response mended = respond(other->problem(), 11);
        CHECK(mended.energy == intact.energy);
        CHECK(difference(body, mended.force, intact.force) == 0);
      }
}

TEST_CASE("kinematics: linear and angular momentum stay in every step in which bonds fail") {
  for (const Example& example : kinematics_examples()) {
    std::size_t failed = 0;
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3})
        for (const std::string criterion : {"type = \"critical_stretch\"\nstretch = 0.03\n", "type = \"smooth_degradation\"\nstretch_min = 0.02\nstretch = 0.05\n",
                                            "type = \"critical_energy\"\nenergy_release_rate = 0.004\n", "type = \"critical_energy\"\nenergy_release_rate = 0.004\nsoftening = 2\n",
                                            "type = \"max_stress\"\nstrength = 0.04\n"}) {
          INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice", ", ", criterion);
          if (!bonds_may_fail(example, d)) continue;
          const bool stress = criterion.find("max_stress") != std::string::npos;
          if (stress && formulation_of(example).pairs) continue;
          if (d == 3 && (stress || criterion.find("soft") != std::string::npos)) continue;   // nothing of their own
          BodyOptions options{.dimension = d, .cloud = cloud, .crack = d > 1, .two_materials = d == 2 && !formulation_of(example).selective()};
          options.material += "\ndensity = 1.0";
          options.conditions = fmt::format("[damage]\n{}[initial]\nvelocity = [{}]\n", criterion,
                                           d == 1   ? "\"0.3*sin(0.4*x)\""
                                           : d == 2 ? "\"0.1*x + 0.2*y + 0.1*sin(y)\", \"-0.3*x + 0.2*cos(0.5*x)*y\""
                                                    : "\"0.1*x + 0.2*y + 0.1*sin(y)\", \"-0.3*x + 0.2*cos(0.5*x)*y + 0.1*z\", \"-0.1*y + 0.1*sin(x)*z\"");
          options.integrator = "type = \"verlet\"\nend_time = 0.4\ntime_step = 0.05";
          const auto simulation = build(scene_text(options, kinematics_table(example)));
          BodyProblem& problem = simulation->problem();
          const Body& body = problem.body();
          // Linear momenta, angular momenta, and what both are relative to: sum m |v| and sum m |x| |v|.
          struct Momenta {
            double linear[3] = {}, angular[3] = {}, speed = 0, turn = 0;
          };
          const auto momenta = [&] {
            Momenta sum;
            const ConstFieldView u = problem.state().displacement(), v = problem.state().velocity();
            for (const std::int32_t p : body.internal()) {
              const double m = problem.masses().by_point()[static_cast<std::size_t>(p)];
              Point x = body.position(static_cast<std::size_t>(p)), speed{};
              for (int c = 0; c < d; ++c) {
                x[static_cast<std::size_t>(c)] += u.component(c)[p];
                speed[static_cast<std::size_t>(c)] = v.component(c)[p];
                sum.linear[c] += m * v.component(c)[p];
              }
              for (std::size_t c = 0; c < 3; ++c) sum.angular[c] += m * (x[(c + 1) % 3] * speed[(c + 2) % 3] - x[(c + 2) % 3] * speed[(c + 1) % 3]);
              sum.speed += m * std::hypot(speed[0], speed[1], speed[2]);
              sum.turn += m * std::hypot(x[0], x[1], x[2]) * std::hypot(speed[0], speed[1], speed[2]);
            }
            return sum;
          };
          std::optional<Momenta> first;
          double drift = 0, turn = 0;
          Watch watch(*simulation);
          watch.each = [&](const StepReport&) {
            const Momenta now = momenta();
            if (!first) first = now;
            for (int c = 0; c < 3; ++c) {
              drift = std::max(drift, std::abs(now.linear[c] - first->linear[c]) / now.speed);
              turn = std::max(turn, std::abs(now.angular[c] - first->angular[c]) / now.turn);
            }
          };
          try {
            simulation->run(watch);
          } catch (const RunError&) {   // a body that bursts may turn inside out; until then everything holds
          }
          failed += problem.families().changed().size();
          CHECK(drift <= 1e-12);
          if (d > 1 && example.keeps_angular_momentum) CHECK(turn <= 1e-12);
        }
    CHECK((failed > 0 || formulation_of(example).force_state == ForceState::local));
  }
}

namespace {

/// Points of a jittered box, in an order and a frame of reference of their own, with an initial velocity in that frame.
struct Arrangement {
  bool backwards = false;                                       ///< the last point first
  std::array<double, 4> frame{1, 0, 0, 1};                      ///< new coordinates are this matrix times the old ones
  std::string velocity_x = "0.02*sin(0.5*x + 0.3*y)", velocity_y = "0.03*sin(0.4*x - 0.6*y)";
};

/// Displacements at the end in the old frame, by the place of the point in the first order, and the number of bonds that were held.
struct Stayed {
  std::vector<double> displacement;
  bool held;
  std::size_t failed;
};

Stayed stay(const std::string& kinematics, const std::string& damage, const Arrangement& as) {
  constexpr int columns = 11, rows = 9;
  const auto turned = [&](double x, double y) { return std::pair(as.frame[0] * x + as.frame[1] * y, as.frame[2] * x + as.frame[3] * y); };
  std::vector<std::array<double, 2>> points;
  Noise random(3);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) points.push_back({i + 0.2 * random(), j + 0.2 * random()});
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (as.backwards) std::ranges::reverse(order);
  TemporaryFolder folder;
  std::ofstream file(folder.path / "points.csv");
  file << "x,y,volume\n";
  for (const std::size_t k : order) {
    const auto [x, y] = turned(points[k][0], points[k][1]);
    file << fmt::format("{:.17g},{:.17g},1\n", x, y);
  }
  file.close();
  const std::string text = fmt::format(
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.points]\nfile = \"points.csv\"\n[family]\nhorizon = 2.6\n[kinematics]\n{}\n"
      "[material]\ntype = \"neo_hookean\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio = 0.25\n[damage]\nsecond_law = true\n{}\n"
      "[initial]\nvelocity = [\"{}\", \"{}\"]\n[integrator]\ntype = \"verlet\"\nend_time = 6.0\ntime_step = 0.2\n",
      kinematics, damage, as.velocity_x, as.velocity_y);
  Simulation simulation(parse_scene(text, folder.path / "scene.toml", subject().registry), subject().registry);
  Watch watch(simulation);
  simulation.run(watch);
  BodyProblem& problem = simulation.problem();
  Stayed stayed{std::vector<double>(2 * points.size()), problem.fracture_summary().find("bonds held") != std::string::npos, problem.families().changed().size()};
  const ConstFieldView u = problem.state().displacement();
  for (const std::int32_t p : problem.body().internal()) {
    const std::size_t k = order[static_cast<std::size_t>(problem.body().number(static_cast<std::size_t>(p)))];
    const double x = u.component(0)[p], y = u.component(1)[p];   // the inverse of the frame is its transpose
    stayed.displacement[2 * k] = as.frame[0] * x + as.frame[2] * y;
    stayed.displacement[2 * k + 1] = as.frame[1] * x + as.frame[3] * y;
  }
  return stayed;
}

}  // namespace

TEST_CASE("kinematics: bonds that stay for the second law are the same whatever the order of the points, mirrored and turned") {
  const Arrangement plain, backwards{.backwards = true},
      mirrored{false, {-1, 0, 0, 1}, "-0.02*sin(-0.5*x + 0.3*y)", "0.03*sin(-0.4*x - 0.6*y)"},
      turned{true, {0, -1, 1, 0}, "-0.03*sin(0.4*y + 0.6*x)", "0.02*sin(0.5*y - 0.3*x)"};   // x = Y, y = -X
  const std::string stretch = "type = \"critical_stretch\"\nstretch = 0.02\n", weaken = "type = \"smooth_degradation\"\nstretch_min = 0.01\nstretch = 0.03\n";
  for (const Example& example : kinematics_examples()) {
    if (!bonds_may_fail(example, 2)) continue;
    bool held = false;
    for (const std::string& damage : {stretch, stretch + "gradual = true\n", weaken}) {
      INFO(example.part, " (", example.table, example.stabilization, "), ", damage);
      const std::string kinematics = kinematics_table(example);
      const Stayed first = stay(kinematics, damage, plain);
      CHECK(first.failed > 0);
      held |= first.held;
      const double scale = std::abs(*std::ranges::max_element(first.displacement, {}, [](double u) { return std::abs(u); }));
      for (const Arrangement& other : {backwards, mirrored, turned}) {
        const Stayed second = stay(kinematics, damage, other);
        CHECK(second.failed == first.failed);
        CHECK(second.held == first.held);
        double most = 0;
        for (std::size_t k = 0; k < first.displacement.size(); ++k) most = std::max(most, std::abs(first.displacement[k] - second.displacement[k]));
        CHECK(most <= 1e-11 * scale);
      }
    }
    // Zero-energy modes always have some.
    if (formulation_of(example).point && example.stabilization.empty()) CHECK(held);
  }
}

TEST_CASE("kinematics: with the second law no bonds fail that would raise the energy") {
  for (const Example& example : kinematics_examples()) {
    std::size_t held = 0;
    for (const bool cloud : {false, true})
      for (const int d : {1, 2})
        for (const bool weaken : {false, true}) {
          INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice",
               weaken ? ", weakening" : "");
          if (!bonds_may_fail(example, d)) continue;
          BodyOptions options{.dimension = d, .cloud = cloud};
          // Noise in a body under pressure: bonds that are longer than at rest resist it.
          const auto noise = [](BodyProblem& problem) {
            Noise random(29);
            set_field(problem.body(), problem.state().displacement(), [&](const Point& x) {
              return Point{0.1 * random() - 0.02 * x[0], 0.1 * random() - 0.02 * x[1], 0.1 * random() - 0.02 * x[2]};
            });
            Response r{0, problem.make_field()};
            REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, r.force, &r.energy).ok());
            return r;
          };
          const auto plain = build(scene_text(options, kinematics_table(example)));
          noise(plain->problem());
          const std::vector<Stretched> all = stretches(plain->problem().body(), plain->problem().state().displacement());
          const std::string criterion =
              weaken ? fmt::format("type = \"smooth_degradation\"\nstretch_min = {:.17g}\nstretch = {:.17g}\n",
                                   quantile(all, 0.92), quantile(all, 0.98))
                     : fmt::format("type = \"critical_stretch\"\nstretch = {:.17g}\n", quantile(all, 0.95));
          const auto scene = [&](bool law) {
            options.conditions = fmt::format("[damage]\nsecond_law = {}\n{}", law, criterion);
            return scene_text(options, kinematics_table(example));
          };
          const auto lawful = build(scene(true)), lawless = build(scene(false)), other = build(scene(true));
          BodyProblem& problem = lawful->problem();
          const Response intact = noise(problem);
          noise(lawless->problem());
          const BondUpdate update = problem.fracture()->update({problem.state().displacement(), 0}, 0),
                           any = lawless->problem().fracture()->update({lawless->problem().state().displacement(), 0}, 0);
          CHECK(update.dissipated >= 0);
          held += update.held;
          CHECK(any.held == 0);
          CHECK(update.changed + update.held > 0);
          const Response left = noise(problem);
          CHECK(std::abs(intact.energy - left.energy - update.dissipated) <= 1e-11 * intact.energy);
          // What raises the energy somewhere is held, and nothing where nothing does. Bonds that are tried again still would.
          if (any.dissipated < 0) CHECK(update.held > 0);
          if (update.held == 0)
            CHECK(problem.families().changed().size() == lawless->problem().families().changed().size());
          const BondUpdate again = problem.fracture()->update({problem.state().displacement(), 0}, 0);
          CHECK(again.dissipated >= 0);
          CHECK((again.changed + again.held > 0) == (update.held > 0));
          // Bonds that were taken back are as if they had never been lowered.
          const Response now = noise(problem);
          other->problem().restore(problem.snapshot());
          const Response same = noise(other->problem());
          CHECK(std::abs(same.energy - now.energy) <= 1e-12 * now.energy);
          CHECK(difference(problem.body(), same.force, now.force) <= 1e-12 * largest(problem.body(), now.force));
          CHECK(slope_error(problem, now) <= 1e-6);
        }
    // Some bonds do stay.
    const Formulation& formulation = formulation_of(example);
    INFO(example.part, " (", example.table, example.stabilization, ")");
    if (formulation.point && example.stabilization.empty()) CHECK(held > 0);
  }
}

TEST_CASE("kinematics: weakened bonds: force = -dE/du, exact tangents, affine motion, momentum") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d)) continue;
        BodyOptions options{.dimension = d, .cloud = cloud, .two_materials = cloud == (d == 2)};
        const auto plain = build(scene_text(options, kinematics_table(example)));
        stretch_at_random(plain->problem().body(), plain->problem().state().displacement(), 17);
        const std::vector<Stretched> all = stretches(plain->problem().body(), plain->problem().state().displacement());
        options.conditions =
            fmt::format("[damage]\ntype = \"smooth_degradation\"\nsecond_law = false\nstretch_min = {:.17g}\nstretch = {:.17g}\n",
                        quantile(all, 0.5), quantile(all, 0.97));
        const std::string text = scene_text(options, kinematics_table(example));
        const auto simulation = build(text);
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        CHECK((body.lattice() != nullptr) == !cloud);   // lattices stay what they are
        const Response intact = respond(problem, 17);
        const BondUpdate update = problem.fracture()->update({problem.state().displacement(), 0}, 0);
        const BondChecks checks = problem.fracture()->checks();
        CHECK(checks.weakened > 0);
        CHECK(checks.failed > 0);
        const Response left = respond(problem, 17);
        CHECK(std::abs(intact.energy - left.energy - update.dissipated) <= 1e-11 * intact.energy);
        CHECK(left.energy < intact.energy);
        CHECK(slope_error(problem, left) <= 1e-6);
        CHECK(tangent_difference(problem) <= 1e-12);
        for (int c = 0; c < d; ++c)
          CHECK(std::abs(total(body, left.force, c)) <= 1e-12 * static_cast<double>(body.points()) * largest(body, left.force));
        const auto other = build(text);
        other->problem().restore(problem.snapshot());
        const Response same = respond(other->problem(), 17);
        CHECK(same.energy == left.energy);
        CHECK(difference(body, same.force, left.force) == 0);
        if (problem.terms().has_gradients()) CHECK(affine_error(problem) <= 1e-12);
      }
}

TEST_CASE("kinematics: bonds fail under laws with history: released energy, momentum, restoring") {
  constexpr double step = 1e-3;
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d) || formulation_of(example).pairs) continue;
        BodyOptions options{.dimension = d, .cloud = cloud, .material = "type = \"hypoelastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3"};
        const auto plain = build(scene_text(options, kinematics_table(example)));
        stretch_at_random(plain->problem().body(), plain->problem().state().displacement(), 19);
        const double most = quantile(stretches(plain->problem().body(), plain->problem().state().displacement()), 0.95);
        options.conditions = fmt::format("[damage]\ntype = \"critical_stretch\"\nsecond_law = false\nstretch = {:.17g}\n", most);
        const std::string text = scene_text(options, kinematics_table(example));
        const auto simulation = build(text), other = build(text);
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        // A small step, then one in which bonds fail, then one of the bonds that are left.
        const auto walk = [](BodyProblem& of, std::uint64_t seed, bool stretch) {
          if (stretch) stretch_at_random(of.body(), of.state().displacement(), seed);
          else deform(of.body(), of.state().displacement(), seed, 0.01);
          Response r{0, of.make_field()};
          const EvaluationStatus status = of.evaluate_forces({of.state().displacement(), 0, step}, r.force, &r.energy);
          REQUIRE_MESSAGE(status.ok(), status.description);
          return r;
        };
        walk(problem, 18, false);
        problem.advance(step);
        const std::size_t before = problem.families().changed().size();
        const Response intact = walk(problem, 19, true);
        const double dissipated = problem.state().energies.dissipated;
        problem.advance(step);
        CHECK(problem.families().changed().size() > before);
        Response left{0, problem.make_field()};
        REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, left.force, &left.energy).ok());
        CHECK(std::abs(intact.energy - left.energy - (problem.state().energies.dissipated - dissipated)) <= 1e-11 * std::abs(intact.energy));
        for (int c = 0; c < d; ++c) CHECK(std::abs(total(body, left.force, c)) <= 1e-12 * static_cast<double>(body.points()) * largest(body, left.force));
        other->problem().restore(problem.snapshot());
        const Response next = walk(problem, 20, true), same = walk(other->problem(), 20, true);
        CHECK(next.energy == same.energy);
        CHECK(difference(body, next.force, same.force) == 0);
      }
}

TEST_CASE("kinematics: where most bonds fail every point has a gradient or is a fragment") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {2, 3})
        for (const double share : {0.5, 0.6}) {
          INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice", ", ", share,
               " of the bonds within the limit");
          if (!bonds_may_fail(example, d)) continue;
          BodyOptions options{.dimension = d, .cloud = cloud};
          const auto plain = build(scene_text(options, kinematics_table(example)));
          if (!plain->problem().terms().has_gradients()) continue;
          stretch_at_random(plain->problem().body(), plain->problem().state().displacement(), 13);
          options.conditions =
              fmt::format("[damage]\ntype = \"critical_stretch\"\nsecond_law = false\nstretch = {:.17g}\n",
                          quantile(stretches(plain->problem().body(), plain->problem().state().displacement()), share));
          const auto simulation = build(scene_text(options, kinematics_table(example)));
          BodyProblem& problem = simulation->problem();
          const Body& body = problem.body();
          const Response intact = respond(problem, 13);
          const BondUpdate update = problem.fracture()->update({problem.state().displacement(), 0}, 0);
          const Response left = respond(problem, 13);
          // Bonds of fragments are accounted for like the others, and named once.
          CHECK(std::abs(intact.energy - left.energy - update.dissipated) <= 1e-11 * intact.energy);
          std::set<std::pair<std::int32_t, std::int32_t>> named;
          for (const BondChange& b : problem.families().changed()) CHECK(named.emplace(b.bond.point, b.bond.far).second);
          CHECK(named.size() == update.changed);
          CHECK(problem.fracture()->update({problem.state().displacement(), 0}, 0).changed == 0);
          for (int c = 0; c < d; ++c) CHECK(std::abs(total(body, left.force, c)) <= 1e-12 * static_cast<double>(body.points()) * largest(body, left.force));
          // No family is left near singular: 0.1 of an intact one, whose condition is below 20, in its weakest direction.
          const Field condition = problem.terms().shape_tensor_condition(), damage = problem.terms().damage();
          std::size_t fragments = 0;
          for (const std::int32_t p : body.internal()) {
            if (damage.data()[p] == 1) ++fragments;
            else CHECK(condition.data()[p] < 200);
          }
          CHECK(fragments > 0);
          CHECK(fragments < body.points());
          // Affine motion stays exact.
          CHECK(affine_error(problem) <= 1e-12);
        }
}

TEST_CASE("kinematics: forces and energies that are renewed near failed bonds are those of the whole body, bit for bit") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d)) continue;
        // Large enough that most points lie far from the place where bonds fail.
        BodyOptions options{.dimension = d, .cloud = cloud, .cells = d == 1 ? 400 : 60, .conditions = limit_of_stretch};
        const auto simulation = build(scene_text(options, kinematics_table(example)));
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        const FieldView u = problem.state().displacement();
        Noise random(23);
        set_field(body, u, [&](const Point&) { return Point{0.02 * random(), 0.02 * random()}; });
        Field force = problem.make_field(), whole = problem.make_field();
        double energy = 0, of_whole = 0;
        REQUIRE(problem.evaluate_forces({u, 0}, force, &energy).ok());
        const double before = energy;
        // One point at the middle of the body goes far from its neighbours.
        std::int32_t torn = body.internal().front();
        const auto off = [&](std::int32_t p) {
          const Point x = body.position(static_cast<std::size_t>(p));
          return std::abs(x[0] - 0.5 * options.cells) + (d > 1 ? std::abs(x[1] - 0.5 * options.cells) : 0.0);
        };
        for (const std::int32_t p : body.internal())
          if (off(p) < off(torn)) torn = p;
        u.component(d - 1)[torn] += d == 1 ? 0.9 : 1.7;
        const BondUpdate update = problem.fracture()->update({u, 0}, 0);
        CHECK(update.changed > 0);
        const std::vector<std::int32_t> moved{torn};
        const EvaluationStatus renewed = problem.terms().renew_forces({u, 0}, moved, update.ends, force, &energy),
                               anew = problem.evaluate_forces({u, 0}, whole, &of_whole);
        REQUIRE(renewed.ok() == anew.ok());
        if (!anew.ok()) continue;
        CHECK(difference(body, force, whole) == 0);
        CHECK(energy == of_whole);
        CHECK(energy != before);
        // And the tangent of the part around them, where families may have become stiffer.
        const std::unique_ptr<DamagedPart> part = problem.damaged_part();
        const Formulation formulation = formulation_of(example);
        if (formulation.weighted || formulation.order > 1) REQUIRE(part);
        if (!part) continue;
        Field w = problem.make_field();
        set_field(body, w, [&](const Point&) { return Point{random(), random()}; });
        mask(part->inside(), w);
        REQUIRE(part->tangent_action({u, 0}, w, force).ok());
        REQUIRE(problem.tangent_action({u, 0}, w, whole).ok());
        mask(part->inside(), force);
        mask(part->inside(), whole);
        CHECK(norm(whole) > 0);
        CHECK(difference(body, force, whole) == 0);
      }
}

TEST_CASE("kinematics: stretches are those of bonds between neighbours that have not failed") {
  for (const bool cloud : {false, true})
    for (const int d : {1, 2, 3}) {
      INFO(d, "D ", cloud ? "cloud" : "lattice");
      const auto simulation = build(scene_text({.dimension = d, .cloud = cloud, .cells = 9, .conditions = limit_of_stretch}, "type = \"baqp\""));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      const FieldView u = problem.state().displacement();
      const auto range = [&](double least, double largest) {
        const StretchRange found = problem.stretches(u);
        CHECK(found.least == doctest::Approx(least).epsilon(1e-12));
        CHECK(found.largest == doctest::Approx(largest).epsilon(1e-12));
      };
      range(1, 1);
      set_field(body, u, [](const Point& x) { return Point{5 - 0.3 * x[0], -0.3 * x[1], -0.3 * x[2]}; });
      range(0.7, 1);
      set_field(body, u, [](const Point& x) { return Point{0.01 * x[0], 0.01 * x[1], 0.01 * x[2]}; });
      range(1, 1.01);
      if (d > 1) set_field(body, u, [](const Point& x) { return Point{-x[0] - x[1], x[0] - x[1], 0}; });   // a turn by 90 degrees
      if (d > 1) range(1, 1);
      // Half of the body flies away: no bond holds it.
      set_field(body, u, [](const Point& x) { return Point{x[0] < 4.5 ? 0.0 : 50.0, 0, 0}; });
      CHECK(problem.stretches(u).largest > 10);
      CHECK(problem.fracture()->update({u, 0}, 0).changed > 0);
      range(1, 1);
    }
}

TEST_CASE("kinematics: points without bonds are free masses") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true})
      for (const int d : {1, 2, 3}) {
        INFO(example.part, " (", example.table, example.stabilization, "), ", d, "D ", cloud ? "cloud" : "lattice");
        if (!bonds_may_fail(example, d)) continue;
        const auto simulation = build(scene_text({.dimension = d, .cloud = cloud, .conditions = limit_of_stretch}, kinematics_table(example)));
        BodyProblem& problem = simulation->problem();
        const Body& body = problem.body();
        set_field(body, problem.state().displacement(), [](const Point& x) { return Point{5 * x[0], 5 * x[1], 5 * x[2]}; });
        CHECK(problem.fracture()->update({problem.state().displacement(), 0}, 0).dissipated > 0);
        // Wherever they fly, even onto each other.
        set_field(body, problem.state().displacement(), [](const Point& x) { return Point{-x[0], -x[1], -x[2]}; });
        Field force = problem.body().make_field(d);
        double energy = 1;
        REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, force, &energy).ok());
        CHECK(energy == 0);
        CHECK(largest(body, force) == 0);
        const Field damage = problem.terms().damage();
        for (const std::int32_t p : body.internal()) CHECK(damage.data()[p] == 1);
      }
}

TEST_CASE("kinematics: a scene without damage pays nothing") {
  for (const Example& example : kinematics_examples())
    for (const bool cloud : {false, true}) {
      INFO(example.part, " (", example.table, example.stabilization, ") ", cloud ? "cloud" : "lattice");
      if (!bonds_may_fail(example, 2)) continue;
      BodyOptions options{.dimension = 2, .cloud = cloud};
      const auto plain = build(scene_text(options, kinematics_table(example)));
      options.conditions = limit_of_stretch;
      const auto failing = build(scene_text(options, kinematics_table(example)));
      CHECK(plain->problem().report().bytes < failing->problem().report().bytes);
      CHECK(plain->problem().fracture() == nullptr);
      CHECK(!plain->problem().update_bonds({plain->problem().state().displacement(), 0}, 0));
      CHECK(plain->problem().fracture_summary().empty());
    }
}
