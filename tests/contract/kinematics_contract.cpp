/// What every kinematics must fulfil, with every material space, on lattices and clouds, intact and cracked: the engine's operator
/// is exact for affine motion, its forces are the derivative of its energy, its tangent the derivative of its forces. A part that declares a local force state must
/// be seen to break what it breaks.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>

#include "perikit/core/parallel.hpp"
#include "tests/contract/fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Where a part says that it does not keep an identity, the suite measures by how much, and holds it to its word: a part that
/// keeps the identity after all must claim it.
class Exceptions {
 public:
  /// Whether c makes no claim; then its relative error is noted.
  bool noted(const Case& c, double error) {
    if (c.example.keeps_angular_momentum) return false;
    double& worst = worst_.try_emplace(c.example.stabilization, 0.0).first->second;
    worst = std::max(worst, error);
    return true;
  }
  void check() const {
    for (const auto& part : worst_) {
      MESSAGE(part.first << " is not objective: relative error up to " << part.second);
      CHECK(part.second > 1e-8);
    }
  }

 private:
  std::map<std::string, double> worst_;
};

/// Poisoned output: whatever a kernel forgets to write shows.
Field poisoned(const BodyProblem& problem) {
  Field f = problem.make_field();
  f.fill(std::numeric_limits<double>::quiet_NaN());
  return f;
}

}  // namespace

TEST_CASE("kinematics: force = -dE/du, tangent = dF/du, symmetric") {
  for (const Case& c : cases_and_tongues()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    deform(body, problem.state().displacement(), 11, 0.02);
    const ConstFieldView u = problem.state().displacement();
    const bool conservative = c.conservative();
    CHECK(problem.terms().conservative() == conservative);
    const Derivatives at = derivatives_at(problem, u, 12, 2e-3 * body.spacing());
    if (conservative) CHECK_MESSAGE(at.force <= 1e-7, "force is not -dE/du: off by ", at.force);
    else CHECK_MESSAGE(at.force > 1e-7, "declared as not conservative, but its force is -dE/du");
    CHECK_MESSAGE(at.tangent <= 1e-7, "tangent is not dF/du: off by ", at.tangent);
    if (conservative) CHECK_MESSAGE(at.asymmetry <= 1e-12, "tangent is not symmetric: off by ", at.asymmetry);
    else CHECK_MESSAGE(at.asymmetry > 1e-12, "declared as not conservative, but its tangent is symmetric");
  }
}

TEST_CASE("kinematics: the volumetric part is the derivative of the volumes of points, and its forces are the adjoint") {
  for (const Case& c : cases()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    const std::unique_ptr<VolumetricPart> volumes = problem.volumetric_part();
    if (!volumes) continue;
    deform(body, problem.state().displacement(), 15, 0.02);
    const ConstFieldView u = problem.state().displacement();
    const Field w = random_direction(problem, 16);
    Field q = body.make_field(1), Bw = body.make_field(1), BTq = problem.make_field();
    Noise noise(17);
    for (const std::int32_t p : body.internal()) q.data()[p] = noise();
    REQUIRE(volumes->linearise(u).ok());
    volumes->rates(w, Bw);
    volumes->forces(q, BTq);
    double left = 0, size = 0;
    for (const std::int32_t p : body.internal()) {
      left += q.data()[p] * Bw.data()[p];
      size += std::abs(q.data()[p] * Bw.data()[p]);
      CHECK(volumes->stiffness().data[p] >= 0);
    }
    CHECK_MESSAGE(std::abs(left - dot(body, BTq, w)) <= 1e-13 * size, "not adjoint: ", left, " against ", dot(body, BTq, w));
    // Entries are of single precision.
    const double h = 1e-4 * body.spacing();
    Field slope = body.make_field(1);
    for (const double sign : {1.0, -1.0}) {
      REQUIRE(volumes->linearise(shifted(problem, u, w, sign * h)).ok());
      for (const std::int32_t p : body.internal()) slope.data()[p] += sign / (2 * h) * volumes->logarithms().data[p];
    }
    for (const std::int32_t p : body.internal())
      CHECK(std::abs(slope.data()[p] - Bw.data()[p]) <= 1e-5 * largest(body, Bw));
  }
}

TEST_CASE("kinematics: linear and angular momentum") {
  Exceptions exceptions;
  for (const Case& c : cases_and_tongues()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    deform(body, problem.state().displacement(), 21, 0.02);
    const Field f = force_of(problem, problem.state().displacement());
    const double scale = largest(body, f);
    Point total{}, moment{};
    double extent = 0, broken = 0;
    for (const std::int32_t p : body.internal()) {
      Point y = body.position(static_cast<std::size_t>(p)), force{};
      for (int a = 0; a < body.dimension(); ++a) {
        y[static_cast<std::size_t>(a)] += problem.state().displacement().component(a)[p];
        force[static_cast<std::size_t>(a)] = f.component(a)[p];
        total[static_cast<std::size_t>(a)] += force[static_cast<std::size_t>(a)];
        extent = std::max(extent, std::abs(y[static_cast<std::size_t>(a)]));
      }
      moment[0] += y[1] * force[2] - y[2] * force[1];
      moment[1] += y[2] * force[0] - y[0] * force[2];
      moment[2] += y[0] * force[1] - y[1] * force[0];
    }
    for (std::size_t a = 0; a < 3; ++a) {
      CHECK_MESSAGE(std::abs(total[a]) <= 1e-11 * scale, "forces do not sum to zero: ", total[a], " of ", scale);
      if (!c.conservative()) {
        broken = std::max(broken, std::abs(moment[a]) / (scale * extent));
        continue;
      }
      if (exceptions.noted(c, std::abs(moment[a]) / (scale * extent))) continue;
      CHECK_MESSAGE(std::abs(moment[a]) <= 1e-11 * scale * extent, "moments do not sum to zero: ", moment[a], " of ", scale * extent);
    }
    if (!c.conservative() && body.dimension() > 1) {
      // The part declares it, the log of a run warns of it, and it is so.
      MESSAGE(c.label(), ": angular momentum is broken by ", broken, " of the largest force times the extent");
      CHECK(!problem.report().warnings.empty());
      CHECK_MESSAGE(broken > 1e-6, "declared as not conservative, but its moments balance");
    }
  }
  exceptions.check();
}

TEST_CASE("kinematics: affine motion is exact") {
  for (const Case& c : cases()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    const double G[3][3] = {{0.1, -0.07, 0.05}, {0.03, -0.06, 0.02}, {-0.04, 0.08, 0.09}};
    const auto d = static_cast<std::size_t>(body.dimension());
    set_field(body, problem.state().displacement(), [&](const Point& x) {
      Point v{0.3, -0.2, 0.1};
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t b = 0; b < d; ++b) v[a] += G[a][b] * x[b];
      return v;
    });
    PointSamples samples;
    REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, samples).ok());
    const bool gradients = problem.terms().has_gradients();   // a pair law has none, only energies
    const Field condition = problem.terms().shape_tensor_condition();
    double worst = 0, densities = 0, energy = energy_of(problem, problem.state().displacement());
    for (const std::int32_t p : body.internal()) {
      densities += samples.strain_energy_density.data()[p] * body.volume(static_cast<std::size_t>(p));
      if (!gradients || !std::isfinite(condition.data()[p]) || condition.data()[p] > 1e4) continue;
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t b = 0; b < d; ++b) {
          const double value = samples.H.component(static_cast<int>(a * d + b))[p];
          worst = std::max(worst, std::abs(value - G[a][b]) / std::max(1.0, condition.data()[p]));
        }
    }
    CHECK_MESSAGE(worst <= 1e-12, "displacement gradient of an affine motion is off by ", worst);
    CHECK_MESSAGE(std::abs(densities - energy) <= 1e-12 * energy, "point energies do not sum to the total: ", densities, " against ", energy);
    if (gradients && !c.body.crack && !c.body.two_materials && c.body.plane == "strain") {
      // The weights of an intact body sum to its volume: a homogeneous state stores exactly V psi(F).
      const double per_volume = energy / (body.volume(static_cast<std::size_t>(body.internal()[0])) * static_cast<double>(body.points()));
      const double expected = samples.strain_energy_density.data()[body.internal()[body.points() / 2]];
      CHECK_MESSAGE(std::abs(per_volume - expected) <= 1e-11 * expected, "a homogeneous state does not store V psi(F)");
    }
  }
}

TEST_CASE("kinematics: a rigid rotation stores nothing, a rotated state stores the same and its forces rotate") {
  Exceptions exceptions;
  for (const Case& c : cases_and_tongues()) {
    if (c.body.dimension == 1) continue;
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    if (problem.terms().has_gradients() && !problem.laws().objective()) continue;
    const Body& body = problem.body();
    // Rotation about (1, 2, 3)/sqrt(14) in 3D, about z in 2D.
    double R[3][3];
    const double angle = 1.1, co = std::cos(angle), si = std::sin(angle);
    const double axis[3] = {c.body.dimension == 3 ? 1 / std::sqrt(14.0) : 0.0, c.body.dimension == 3 ? 2 / std::sqrt(14.0) : 0.0, c.body.dimension == 3 ? 3 / std::sqrt(14.0) : 1.0};
    const double cross[3][3] = {{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) R[a][b] = (a == b ? co : 0.0) + (1 - co) * axis[a] * axis[b] + si * cross[a][b];
    deform(body, problem.state().displacement(), 31, 0.02);
    const FieldView u = problem.state().displacement();
    const double energy = energy_of(problem, u);
    const Field f = force_of(problem, u);
    Field rotated = problem.body().make_field(u.components), turned = problem.body().make_field(u.components);
    for (const std::int32_t p : body.internal()) {
      const Point x = body.position(static_cast<std::size_t>(p));
      for (int a = 0; a < u.components; ++a) {
        double y = 0, rigid = 0;
        for (int b = 0; b < u.components; ++b) {
          y += R[a][b] * (x[static_cast<std::size_t>(b)] + u.component(b)[p]);
          rigid += R[a][b] * x[static_cast<std::size_t>(b)];
        }
        rotated.component(a)[p] = y - x[static_cast<std::size_t>(a)];
        turned.component(a)[p] = rigid - x[static_cast<std::size_t>(a)];
      }
    }
    const Field g = force_of(problem, rotated);
    double worst = 0;
    for (const std::int32_t p : body.internal())
      for (int a = 0; a < u.components; ++a) {
        double expected = 0;
        for (int b = 0; b < u.components; ++b) expected += R[a][b] * f.component(b)[p];
        worst = std::max(worst, std::abs(g.component(a)[p] - expected));
      }
    const double change = std::abs(energy_of(problem, rotated) - energy);
    if (!exceptions.noted(c, change / energy)) {
      CHECK_MESSAGE(change <= 1e-11 * energy, "energy changes under rotation");
      CHECK_MESSAGE(worst <= 1e-11 * largest(body, f), "forces do not rotate: ", worst, " of ", largest(body, f));
    }
    CHECK_MESSAGE(energy_of(problem, turned) <= 1e-20 * energy + 1e-24, "a rigid rotation stores energy");
    CHECK_MESSAGE(largest(body, force_of(problem, turned)) <= 1e-11 * largest(body, f), "a rigid rotation has forces");
  }
  exceptions.check();
}

TEST_CASE("kinematics: a body at rest is bitwise at rest") {
  for (const Case& c : cases()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    CHECK(energy_of(problem, problem.state().displacement()) == 0.0);
    CHECK(largest(problem.body(), force_of(problem, problem.state().displacement())) == 0.0);
  }
}

TEST_CASE("kinematics: neither units nor a factor of the influence function matter") {
  for (const Case& c : cases()) {
    INFO(c.label());
    BodyOptions other = c.body;
    other.scale = 1e-3;   // m -> km, say
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    const auto scaled = build(scene_text(other, kinematics_table(c.example)));
    BodyOptions factor = c.body;
    BodyOptions plain = c.body;
    plain.influence = "type = \"expression\", formula = \"exp(-r^2)\"";
    factor.influence = "type = \"expression\", formula = \"37.5 * exp(-r^2)\"";
    const auto with_factor = build(scene_text(factor, kinematics_table(c.example)));
    deform(simulation->problem().body(), simulation->problem().state().displacement(), 41, 0.02);
    const auto copy = [&](Simulation& to, double scale) {
      for (std::size_t k = 0; k < simulation->problem().state().displacement().size(); ++k) {
        to.problem().state().displacement().data[k] = scale * simulation->problem().state().displacement().data[k];
      }
    };
    copy(*scaled, other.scale);
    copy(*with_factor, 1.0);
    const Body& body = simulation->problem().body();
    const Field f = force_of(simulation->problem(), simulation->problem().state().displacement());
    const Field g = force_of(scaled->problem(), scaled->problem().state().displacement());
    const Field h = force_of(with_factor->problem(), with_factor->problem().state().displacement());
    double units = 0, factors = 0;
    const double area = other.scale * other.scale;
    for (const std::int32_t p : body.internal())
      for (int a = 0; a < f.components(); ++a) {
        units = std::max(units, std::abs(g.component(a)[p] / area - f.component(a)[p]));
        factors = std::max(factors, std::abs(h.component(a)[p] - f.component(a)[p]));
      }
    CHECK_MESSAGE(units <= 1e-10 * of_iterations(c.example) * largest(body, f), "forces depend on the unit of length: ", units / largest(body, f));
    CHECK_MESSAGE(factors <= 1e-10 * of_iterations(c.example) * largest(body, f), "forces depend on a factor of omega: ", factors / largest(body, f));
  }
}

TEST_CASE("kinematics: bitwise the same for one, two and three threads, and to rounding without savings") {
  for (const Case& c : cases()) {
    if (c.body.dimension == 1 && c.body.cloud) continue;
    INFO(c.label());
    BodyOptions body = c.body;
    if (body.dimension == 1) body.cells = 5000;
    if (body.dimension == 2) body.cells = 60;
    if (body.dimension == 3) body.cells = c.body.cloud ? 12 : 16;
    const auto simulation = build(scene_text(body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    deform(problem.body(), problem.state().displacement(), 51, 0.02);
    const int threads = thread_count();
    set_thread_count(1);
    const Field one = force_of(problem, problem.state().displacement());
    const double energy = energy_of(problem, problem.state().displacement());
    for (const int count : {2, 3}) {
      set_thread_count(count);
      const Field more = force_of(problem, problem.state().displacement());
      CHECK_MESSAGE((energy == energy_of(problem, problem.state().displacement()) && difference(problem.body(), one, more) == 0), "the result is another one with ", count, " threads");
    }
    set_thread_count(threads);
    body.skip = body.share = false;
    const auto plain = build(scene_text(body, kinematics_table(c.example)));
    std::copy_n(problem.state().displacement().data, problem.state().displacement().size(), plain->problem().state().displacement().data);
    const Field full = force_of(plain->problem(), plain->problem().state().displacement());
    double worst = difference(problem.body(), one, full);
    CHECK_MESSAGE(worst <= 1e-12 * largest(problem.body(), one), "savings change the result by ", worst / largest(problem.body(), one));
    const Field w = random_direction(problem, 52);
    Field Kw = poisoned(problem), expected = poisoned(problem);
    REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, w, Kw).ok());
    REQUIRE(plain->problem().tangent_action({problem.state().displacement(), 0}, w, expected).ok());
    worst = difference(problem.body(), Kw, expected);
    CHECK_MESSAGE(worst <= 1e-12 * largest(problem.body(), Kw), "savings change the tangent by ", worst / largest(problem.body(), Kw));
  }
}

namespace {

void check_same(const Body& body, ConstFieldView a, ConstFieldView b) {
  REQUIRE(a.size() == b.size());
  CHECK(difference(body, a, b) == 0);
}

void check_same(const Body& body, const PointSamples& a, const PointSamples& b) {
  check_same(body, a.strain_energy_density, b.strain_energy_density);
  check_same(body, a.H, b.H);
  check_same(body, a.P, b.P);
  check_same(body, a.cauchy, b.cauchy);
  check_same(body, a.von_mises, b.von_mises);
}

}  // namespace

TEST_CASE("kinematics: samples that an evaluation of forces takes along are those of a pass of their own, bit for bit") {
  for (const Case& c : cases())
    for (const std::string plane : {"strain", "stress"}) {
      if (plane == "stress" && (c.body.dimension == 3 || formulation_of(c.example).selective())) continue;
      INFO(c.label(), ", plane ", plane);
      BodyOptions options = c.body;
      options.plane = plane;
      const auto simulation = build(scene_text(options, kinematics_table(c.example)));
      BodyProblem& problem = simulation->problem();
      const FieldView u = problem.state().displacement();
      deform(problem.body(), u, 21, 0.02);
      double energy = 0, energy_along = 0;
      const Field force = force_of(problem, u, &energy);
      for (const Sampling asked : {Sampling::tensors, Sampling::energy, Sampling::von_mises}) {
        PointSamples alone{.asked = asked}, along{.asked = asked};
        REQUIRE(problem.terms().sample({u, 0}, alone).ok());
        problem.sample_along(asked);
        check_same(problem.body(), force_of(problem, u, &energy_along), force);
        CHECK(energy_along == energy);
        REQUIRE(problem.sample(along).ok());
        check_same(problem.body(), along, alone);
      }
      // Those of other displacements, or other ones, are taken anew.
      problem.sample_along(Sampling::von_mises);
      force_of(problem, u);
      deform(problem.body(), u, 22, 0.02);
      for (const Sampling asked : {Sampling::von_mises, Sampling::energy}) {
        PointSamples alone{.asked = asked}, later{.asked = asked};
        REQUIRE(problem.terms().sample({u, 0}, alone).ok());
        REQUIRE(problem.sample(later).ok());
        check_same(problem.body(), later, alone);
      }
    }
}
