/// Gc as the run sees it: a body is expanded alike in all directions until its first bonds fail, which is known in closed form for every influence
/// function; and what is torn off along an interface of unlike materials takes the Gc of that interface.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/kit/vector_text.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// With the parts of this build.
constexpr double Gc = 100, lame = 4e5, spacing = 0.1, m = 3.015;   // lambda = mu

struct Kernel {
  std::string table;
  std::function<double(double)> value;
};
const std::vector<Kernel> kernels{{"\"constant\"", [](double) { return 1.0; }},
                                  {"\"inverse\"", [](double r) { return 1 / r; }},
                                  {"\"cone\"", [](double r) { return 1 - r; }},
                                  {"\"gaussian\"", [](double r) { return std::exp(-r * r); }},
                                  {"\"cubic_spline\"", [](double r) { return r <= 0.5 ? 1 - 6 * r * r * (1 - r) : 2 * std::pow(1 - r, 3); }},
                                  {"{ type = \"expression\", formula = \"5*exp(-r^2)\" }", [](double r) { return 5 * std::exp(-r * r); }}};

enum class CrackPoints { lattice, cloud };

std::string scene(int dimension, CrackPoints points, const std::string& kinematics, const Kernel& kernel, const std::string& limit, bool interface) {
  const double width = dimension == 3 ? 1.2 : 2.4;
  std::string rim;
  for (int a = 0; a < dimension; ++a) rim += fmt::format("{0}{1} < 0.35 || {1} > {2}", a > 0 ? " || " : "", "xyz"[a], width - 0.35);
  const auto damage = [&](double of_crack) { return fmt::format("type = \"critical_energy\", energy_release_rate = {}, limit = \"{}\"", of_crack, limit); };
  std::string further;
  if (interface)
    further = "[[region]]\nset = \"upper\"\nmaterial = { type = \"linear_elastic\", youngs_modulus = 1.0e6, poisson_ratio = 0.25 }\n"
              "[[interface]]\nbetween = [\"upper\", \"rest\"]\ndamage = { " + damage(Gc) + " }\n";
  further += fmt::format("[damage]\ntype = \"critical_energy\"\nenergy_release_rate = {}\nlimit = \"{}\"\nno_fail = [\"rim\"]\n", interface ? 1e6 : Gc, limit);
  // Balanced clouds have other weights near their surfaces.
  return test::SceneText{.dimension = dimension, .spacing = spacing, .upper = std::vector<double>(static_cast<std::size_t>(dimension), width),
                         .lattice = fmt::format("jitter = {}", points == CrackPoints::cloud ? 1e-9 : 0.0), .sets = fmt::format("upper = \"x > {}\"\nrim = \"{}\"", width / 2, rim),
                         .family = fmt::format("horizon_ratio = {}\ninfluence = {}\n{}", m, kernel.table, points == CrackPoints::cloud ? "consistent = false" : ""), .kinematics = kinematics,
                         .material = "type = \"linear_elastic\"\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25",
                         .further = further + "[[boundary]]\nset = \"all\"\ndisplacement = " + test::vector_text(dimension, 0, 0, 0), .integrator = "type = \"newton\"\nsteps = 1"};
}

/// Strain at which the first bonds hold their part of Gc: 2 W/m0 omega = Gc omega/S, W = (2 lambda + 2 mu) e^2 in plane strain.
double first_strain(int dimension, CrackPoints points, const Kernel& kernel, const std::string& limit) {
  double m0 = 0, along = 0, plain = 0, mean = 0, mean_plain = 0, largest = 0;
  const int reach = static_cast<int>(m), ry = dimension > 1 ? reach : 0, rz = dimension > 2 ? reach : 0;
  for (int z = -rz; z <= rz; ++z)
    for (int y = -ry; y <= ry; ++y)
      for (int x = -reach; x <= reach; ++x) {
        const double length = std::sqrt(double(x * x + y * y + z * z));
        if (length == 0 || length > m) continue;
        const double omega = kernel.value(length / m), volume = std::pow(spacing, dimension);
        m0 += omega * volume;
        largest = std::max(largest, omega);
        along += omega * std::max(0, x) * spacing * volume;
        plain += std::max(0, x) * spacing * volume;
        mean += omega * length * spacing * volume;
        mean_plain += length * spacing * volume;
      }
  const double of_mean = dimension == 3 ? 0.25 : dimension == 2 ? 1 / std::numbers::pi : 0.5;
  const bool cloud = points == CrackPoints::cloud;
  const double crossing = limit == "shared" ? (cloud ? of_mean * mean : along) : (cloud ? of_mean * mean_plain : plain) * largest;
  const double energy = dimension == 3 ? 7.5 * lame : dimension == 2 ? 4 * lame : 1.5 * lame;
  return std::sqrt(Gc * m0 / (2 * energy * crossing));
}

bool fails_at(Simulation& simulation, double strain) {
  BodyProblem& problem = simulation.problem();
  contract::set_field(problem.body(), problem.state().displacement(), [&](const Point& x) { return Point{strain * x[0], strain * x[1], strain * x[2]}; });
  return problem.advance(0);
}

}  // namespace

TEST_CASE("critical_energy: the first bonds of an expanded body fail at Gc, with every influence function") {
  for (const char* const kinematics : {"type = \"baqp\"", "type = \"projection\"", "type = \"conventional\"\nstabilization = \"wan\""})
    for (int d = 1; d <= 3; ++d)
      for (const CrackPoints points : {CrackPoints::lattice, CrackPoints::cloud})
        for (const std::string limit : {"shared", "equal"})
          for (const bool interface : {false, true})
            for (const Kernel& kernel : kernels) {
              if (d == 3 && (interface || points == CrackPoints::cloud)) continue;
              INFO(fmt::format("{}, {}D, {}, {}, {}{}", kinematics, d, points == CrackPoints::cloud ? "cloud" : "lattice", limit, kernel.table, interface ? ", interface" : ""));
              // Bonds of `projection` have equal parts of the energy.
              const bool equal_parts = std::string(kinematics).find("projection") != std::string::npos;
              const double strain = first_strain(d, points, equal_parts ? kernels[0] : kernel, limit);
              const auto simulation = build(scene(d, points, kinematics, kernel, limit, interface));
              CHECK_FALSE(fails_at(*simulation, strain * (1 - 1e-6)));
              CHECK(fails_at(*simulation, strain * (1 + 1e-6)));
            }
}

namespace {

/// Two halves that are drawn apart: what is dissipated at the interface between them.
double torn_off(int dimension, const std::string& kinematics, const std::string& damage, double modulus, double jitter, const std::string& laminates = "") {
  const std::string material = "type = \"linear_elastic\", density = 1000.0, poisson_ratio = 0.25, youngs_modulus = ";
  const auto list = [&](const char* along, const char* across) {
    return dimension == 1 ? fmt::format("[{}]", along) : dimension == 2 ? fmt::format("[{}, {}]", along, across) : fmt::format("[{}, {}, {}]", along, across, across);
  };
  const double width = dimension == 3 ? 0.8 : 1.0;
  const std::string scene = fmt::format(
      "format = 1\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = 0.1\nlower = {}\nupper = {}\njitter = {}\n[sets]\nupper = \"x > 1\"\ntop = \"x > 1.65\"\nbottom = \"x < 0.35\"\n"
      "[family]\nhorizon_ratio = 3.015\n{}[kinematics]\n{}\n[material]\ntype = \"linear_elastic\"\ndensity = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25\n"
      "[[region]]\nset = \"upper\"\nmaterial = {{ {}{} }}\n[damage]\n{}\nenergy_release_rate = 1.0e7\nno_fail = [\"top\", \"bottom\"]\n"
      "[[interface]]\nbetween = [\"upper\", \"rest\"]\ndamage = {{ {}, energy_release_rate = 100.0 }}\n"
      "[[boundary]]\nset = \"top\"\nvelocity = {}\n[[boundary]]\nset = \"bottom\"\nvelocity = {}\n[initial]\nvelocity = {}\n[integrator]\ntype = \"verlet\"\nend_time = 0.15\n",
      dimension, dimension == 1 ? "line = \"stress\"\n" : dimension == 2 ? "plane = \"strain\"\n" : "", list("0", "0"), list("2", fmt::format("{}", width).c_str()), jitter,
      laminates.empty() ? "" : "interfaces = \"" + laminates + "\"\n", kinematics, material, modulus, damage,
      [&] {
        std::string inline_table = damage;
        std::ranges::replace(inline_table, '\n', ',');
        return inline_table;
      }(),
      list("\"0.5\"", "\"free\""), list("\"-0.5\"", "\"free\""), list("\"0.5*(x-1)\"", "\"0\""));
  const auto simulation = build(scene);
  const double area = dimension == 1 ? 1 : dimension == 2 ? width : width * width;
  return contract::run(*simulation).energies.back().dissipated / area / Gc;
}

}  // namespace

TEST_CASE("critical_stretch: an interface between unlike halves takes as much as between equal ones") {
  const std::string stretch = "type = \"critical_stretch\"", consistent = stretch + "\nconsistent = true";
  struct Subject {
    std::string kinematics, damage;
    int dimension;
    double tolerance;
  };
  const std::vector<Subject> subjects{{"type = \"bond_based\"", stretch, 1, 0.1}, {"type = \"bond_based\"", stretch, 2, 0.1}, {"type = \"bond_based\"", stretch, 3, 0.1},
                                      {"type = \"ordinary\"", stretch, 2, 0.1},   {"type = \"baqp\"", consistent, 2, 0.1},    {"type = \"projection\"", consistent, 2, 0.15}};
  for (const Subject& s : subjects)
    for (const bool cloud : {false, true}) {
      if (cloud && s.dimension == 3) continue;
      INFO(fmt::format("{}, {}D, {}", s.kinematics, s.dimension, cloud ? "cloud" : "lattice"));
      const double equal = torn_off(s.dimension, s.kinematics, s.damage, 1e6, cloud ? 1e-3 : 0), unlike = torn_off(s.dimension, s.kinematics, s.damage, 1e8, cloud ? 1e-3 : 0);
      MESSAGE(s.kinematics, ", ", s.dimension, "D, ", cloud ? std::string("cloud") : std::string("lattice"), ": G/Gc ", equal, " and ", unlike);
      CHECK(std::abs(unlike - equal) < s.tolerance * equal);
    }
  const double parallel = torn_off(2, "type = \"bond_based\"", stretch, 1e8, 0, "parallel");
  MESSAGE("bond_based, side by side: ", parallel);
  CHECK(std::abs(parallel - 1) < 0.05);
}

TEST_CASE("pair laws with factors by moments: what is torn off takes Gc within 8 %, by stretch and by the shares of energy") {
  // Without factors `bond_based` takes 0.74 to 0.89 of it, in 2D and 3D. On a line neighbours spring back while bonds fail one by one, as they do without.
  for (const std::string kinematics : {"bond_based", "ordinary"})
    for (const std::string damage : {"type = \"critical_stretch\"", "type = \"critical_energy\""})
      for (const std::pair<int, double>& body : {std::pair(2, 0.0), std::pair(3, 0.0), std::pair(2, 0.1)}) {
        const int d = body.first;
        const double jitter = body.second, ratio = torn_off(d, fmt::format("type = \"{}\"\nsurface_correction = \"moments\"", kinematics), damage, 1e6, jitter);
        INFO(fmt::format("{}, {}, {}D, jitter {}: G/Gc {}", kinematics, damage, d, jitter, ratio));
        CHECK(std::abs(ratio - 1) < 0.08);
      }
}

TEST_CASE("critical_stretch: bonds across two materials without an interface are no weaker than those of the softer one") {
  // Under a traction along y the soft half has 100 times the strain of the stiff one.
  const std::string scene =
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 2]\n[sets]\nupper = \"y > 1\"\n"
      "[family]\nhorizon_ratio = 3.015\n[kinematics]\ntype = \"bond_based\"\nsurface_correction = \"none\"\n[material]\ntype = \"linear_elastic\"\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25\n"
      "[[region]]\nset = \"upper\"\nmaterial = { type = \"linear_elastic\", youngs_modulus = 1.0e8, poisson_ratio = 0.25 }\n"
      "[damage]\ntype = \"critical_stretch\"\nenergy_release_rate = 100.0\n[[boundary]]\nset = \"all\"\ndisplacement = [0, 0]\n[integrator]\ntype = \"newton\"\nsteps = 1\n";
  const double limit = std::sqrt(std::numbers::pi * Gc / (3 * 8e5 * 0.3015));
  const auto simulation = build(scene);
  const auto fails = [&](double strain) {
    BodyProblem& problem = simulation->problem();
    contract::set_field(problem.body(), problem.state().displacement(), [&](const Point& x) { return Point{0, strain * (x[1] - 1) * (x[1] > 1 ? 0.01 : 1.0), 0}; });
    return problem.advance(0);
  };
  CHECK_FALSE(fails(0.999 * limit));
  CHECK(fails(1.001 * limit));
}
