// Points that lie on held faces, held surfaces and planes of symmetry, with the part of their cell that lies inside: nodes of a mesh.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <random>

#include "tests/kit/registry.hpp"
#include "unit/part_comparison.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// The nodes of a box of unit cells, inner ones moved by up to 0.2; with their shares of the cells, or those of whole cells.
std::string nodes(const std::vector<int>& cells, bool moved, bool whole_cells = false) {
  std::mt19937_64 random(1);
  const auto number = [&] { return 0.4 * static_cast<double>(random() >> 11) * 0x1.0p-53 - 0.2; };
  std::string csv = moved ? "x,y,z\n" : "x,y,z,volume\n";
  std::array<int, 3> most{};
  std::copy(cells.begin(), cells.end(), most.begin());
  for (int i = 0; i <= most[0]; ++i)
    for (int j = 0; j <= most[1]; ++j)
      for (int k = 0; k <= most[2]; ++k) {
        const std::array<int, 3> at{i, j, k};
        double volume = 1;
        std::array<double, 3> x{};
        for (std::size_t c = 0; c < cells.size(); ++c) {
          const bool on_side = at[c] == 0 || at[c] == most[c];
          x[c] = at[c] + (moved && !on_side ? number() : 0.0);
          if (on_side && !whole_cells) volume /= 2;
        }
        csv += fmt::format("{},{},{}", x[0], x[1], x[2]) + (moved ? "\n" : fmt::format(",{}\n", volume));
      }
  return csv;
}

class Bar {
 public:
  Bar(const std::vector<int>& cells, bool moved, bool whole_cells = false) : cells_(cells) {
    std::ofstream(folder_.path / "nodes.csv") << nodes(cells, moved, whole_cells);
    std::string upper;
    for (const int n : cells) upper += fmt::format("{}{}", upper.empty() ? "" : ", ", n);
    body_ = fmt::format("[body.points]\nfile = \"{}\"\n{}", (folder_.path / "nodes.csv").string(),
                        moved ? fmt::format("volume = \"voronoi\"\nlower = [{}]\nupper = [{}]\n", all("0"), upper) : "");
  }
  std::string all(const std::string& value) const {
    std::string text = value;
    for (std::size_t c = 1; c < cells_.size(); ++c) text += ", " + value;
    return text;
  }
  std::string scene(const std::string& kinematics, const std::string& boundaries, const std::string& integrator) const {
    return SceneText{.dimension = static_cast<int>(cells_.size()), .space = "stress", .body = body_, .sets = fmt::format("left = \"x < 0.001\"\nright = \"x > {} - 0.001\"", cells_[0]),
                     .family = "horizon_ratio = 2.515", .kinematics = kinematics,
                     .material = "type = \"linear_elastic\"\ndensity = 1.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25", .further = boundaries + "[run]\nthreads = 1\n",
                     .integrator = integrator};
  }
  std::string refusal(const std::string& boundaries) const {
    return message_of<InputError>([&] { simulation_of(scene("baqp", boundaries, "type = \"newton\"\nsteps = 1")); });
  }
  /// Of the field of uniaxial stress: energy, and the largest force on free components, over those that the field has.
  struct Stretched {
    double energy, force;
    std::size_t warnings;
  };
  Stretched stretched(const std::string& kinematics, const std::string& held) const {
    const double strain = 1e-3;
    std::string field = fmt::format("\"{}*x\"", strain);
    const char* across[] = {"", "y", "z"};
    for (std::size_t c = 1; c < cells_.size(); ++c) field += fmt::format(", \"-0.25*{}*{}\"", strain, across[c]);
    std::string boundaries;
    const std::string key = fmt::format("displacement = [\"{}*x\"{}]\n", strain, cells_.size() == 1 ? "" : cells_.size() == 2 ? ", \"free\"" : ", \"free\", \"free\"");
    for (const char* side : {"-x", "+x"})
      boundaries += fmt::format("[[boundary]]\n{} = \"{}\"\n{}", held == "face" ? "face" : "set", held == "face" ? side : side[0] == '-' ? "left" : "right", key);
    if (held == "face")
      for (std::size_t c = 1; c < cells_.size(); ++c) boundaries += fmt::format("[[symmetry]]\naxis = \"{}\"\n", across[c]);
    const auto simulation = simulation_of(scene(kinematics, boundaries + fmt::format("[initial]\ndisplacement = [{}]\n", field), "evaluate"));
    BodyProblem& problem = simulation->problem();
    Field force = problem.make_field();
    double energy = 0;
    REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0, 0}, force, &energy).ok());
    double volume = 1, largest = 0;
    for (const int n : cells_) volume *= n;
    const ConstFieldView free = problem.constraints().free();
    for (const std::int32_t p : problem.body().owned())
      for (int c = 0; c < problem.dimension(); ++c) largest = std::max(largest, std::abs(force.component(c)[p] * free.component(c)[p]));
    return {energy / (0.5 * 1e6 * strain * strain * volume), largest / (1e6 * strain), problem.report().warnings.size()};
  }
  const std::string& body() const { return body_; }

 private:
  std::vector<int> cells_;
  TemporaryFolder folder_;
  std::string body_;
};

constexpr const char* with_gradients[] = {"type = \"baqp\"", "type = \"projection\"", "type = \"bond_augmented\"", "type = \"bond_associated\"", "type = \"non_spherical\"",
                                          "type = \"sub_horizon\"", "type = \"conventional\"\nstabilization = \"silling\""};

}  // namespace

TEST_CASE("a bar of nodes that is stretched at its ends, held as faces or as sets, has the energy of the bar and is in equilibrium") {
  for (const char* kinematics : with_gradients)
    for (const std::vector<int>& cells : {std::vector<int>{10}, {10, 5}, {6, 4, 5}})
      for (const bool moved : {false, true})
        for (const char* held : {"face", "set"}) {
          if (cells.size() == 3 && (moved || std::string(kinematics) != with_gradients[0])) continue;   // seconds each
          INFO(std::string(kinematics), ", ", cells.size(), "D, moved ", moved, ", ", std::string(held));
          // `sub_horizon` does not balance this line of points, and says so.
          const bool unbalanced = cells.size() == 1 && moved && std::string(kinematics) == "type = \"sub_horizon\"";
          const auto [energy, force, warnings] = Bar(cells, moved).stretched(kinematics, held);
          CHECK(energy == doctest::Approx(1.0).epsilon(1e-9));
          CHECK(warnings == (unbalanced ? 1 : 0));
          if (!unbalanced) CHECK(force < 2e-3);
        }
}

TEST_CASE("a traction on nodes of a side keeps the bar in equilibrium, beside a plane of symmetry, too") {
  for (const char* kinematics : with_gradients)
    for (const std::vector<int>& cells : {std::vector<int>{12}, {12, 5}})
      for (const bool moved : {false, true}) {
        if (cells.size() == 1 && moved && std::string(kinematics) == "type = \"sub_horizon\"") continue;   // does not balance this line of points
        INFO(std::string(kinematics), ", ", cells.size(), "D, moved ", moved);
        const Bar bar(cells, moved);
        const bool flat = cells.size() == 2;
        const auto simulation = simulation_of(bar.scene(
            kinematics,
            std::string("[[boundary]]\nface = \"-x\"\ndisplacement = [0") + (flat ? ", \"free\"]\n[[symmetry]]\naxis = \"y\"\n" : "]\n") +
                "[[load]]\nset = \"right\"\nface = \"+x\"\ntraction = [1.0e3" + (flat ? ", 0]\n" : "]\n") +
                "[initial]\ndisplacement = [\"1e-3*x\"" + (flat ? ", \"-0.25e-3*y\"]\n" : "]\n"),
            "evaluate"));
        BodyProblem& problem = simulation->problem();
        Field force = problem.make_field(), load = problem.make_field();
        double energy = 0, largest = 0, work = 0;
        REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0, 0}, force, &energy).ok());
        problem.loads().evaluate(0, load);
        const ConstFieldView free = problem.constraints().free();
        for (const std::int32_t p : problem.body().owned()) {
          work += load.component(0)[p] * problem.body().position(static_cast<std::size_t>(p))[0];
          for (int c = 0; c < problem.dimension(); ++c)
            largest = std::max(largest, std::abs((force.component(c)[p] + load.component(c)[p]) * free.component(c)[p]));
        }
        CHECK(largest < 2.0);   // of 1000 a spacing
        CHECK(work == doctest::Approx(1e3 * 12 * (flat ? 5 : 1)).epsilon(1e-6));
      }
}

TEST_CASE("where a side lies is found by volumes, and said") {
  const Bar bar({10, 5}, false);
  const std::string faces = "[[boundary]]\nface = \"-x\"\ndisplacement = [0, 0]\n[[symmetry]]\naxis = \"y\"\n";
  const auto on_side = simulation_of(bar.scene("type = \"baqp\"", faces, "type = \"newton\"\nsteps = 1"));
  REQUIRE(on_side->problem().notes().size() == 2);
  CHECK(on_side->problem().notes()[0] == "-x at 0, by the volumes of its points, which are those of half cells; its points lie on it");
  const Bar centroids({10, 5}, false, true);
  const auto beyond = simulation_of(centroids.scene("type = \"baqp\"", faces, "type = \"newton\"\nsteps = 1"));
  CHECK(beyond->problem().notes()[0] == "-x at -0.5, by the volumes of its points, half a cell beyond them");
  const Bar box({10, 5}, true);
  CHECK(simulation_of(box.scene("type = \"baqp\"", faces, "type = \"newton\"\nsteps = 1"))->problem().notes()[0] == "-x at 0, that of the box of the points' cells; its points lie on it");
}

TEST_CASE("points on or near sides that cannot be right are refused at once") {
  const Bar whole({10}, false, true), half({10}, false);
  CHECK(half.refusal("[[boundary]]\nface = \"-x\"\nat = 0\ndisplacement = [0]\n").empty());
  CHECK(half.refusal("[[symmetry]]\naxis = \"x\"\nat = 0\n[[boundary]]\nset = \"right\"\ndisplacement = [0]\n").empty());
  CHECK(contains(whole.refusal("[[boundary]]\nface = \"-x\"\nat = 0\ndisplacement = [0]\n"), "found points on the side, at 0, that have 1 times the volume of those behind them"));
  CHECK(contains(whole.refusal("[[symmetry]]\naxis = \"x\"\nat = 0\n"), "found points on the side, at 0, that have 1 times the volume of those behind them"));
  CHECK(contains(whole.refusal("[[boundary]]\nface = \"-x\"\nat = -0.01\ndisplacement = [0]\n"), "found a side at -0.01, with a point 0.01 spacings from it"));
  CHECK(contains(half.refusal("[[periodic]]\naxis = \"x\"\nlower = 0\nupper = 10\n"), "found points on both sides, at 0 and 10, which are the same places"));
}

TEST_CASE("curved surfaces with points on them: a ring between two held surfaces stores what its affine motion has") {
  TemporaryFolder folder;
  {
    std::ofstream csv(folder.path / "ring.csv");
    csv << "x,y,volume\n";
    constexpr int rings = 10, around = 96;
    for (int i = 0; i <= rings; ++i)
      for (int k = 0; k < around; ++k) {
        const double h = 1.0 / rings, r = 1 + i * h, inner = std::max(1.0, r - h / 2), outer = std::min(2.0, r + h / 2), angle = (k + 0.5 * (i % 2)) * 2 * M_PI / around;
        csv << fmt::format("{},{},{}\n", r * std::cos(angle), r * std::sin(angle), M_PI * (outer * outer - inner * inner) / around);
      }
  }
  const std::string held = "[[boundary]]\nsurface = \"1 - sqrt(x^2 + y^2)\"\ndisplacement = [\"0.01*x\", 0]\n[[boundary]]\nsurface = \"sqrt(x^2 + y^2) - 2\"\ndisplacement = [\"0.01*x\", 0]\n";
  const auto simulation = simulation_of(SceneText{.body = fmt::format("[body.points]\nfile = \"{}\"", (folder.path / "ring.csv").string()), .family = "horizon_ratio = 2.515",
                                                  .material = "type = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.0",
                                                  .further = held + "[initial]\ndisplacement = [\"0.01*x\", 0]"});
  BodyProblem& problem = simulation->problem();
  Field force = problem.make_field();
  double energy = 0;
  REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0, 0}, force, &energy).ok());
  CHECK(energy == doctest::Approx(0.5 * 1e-4 * 3 * M_PI).epsilon(1e-6));
  double largest = 0;
  const ConstFieldView free = problem.constraints().free();
  for (const std::int32_t p : problem.body().owned())
    for (int c = 0; c < 2; ++c) largest = std::max(largest, std::abs(force.component(c)[p] * free.component(c)[p]));
  CHECK(largest < 0.01 * 0.01 * 0.1);   // 0.01 of stress times spacing
}

TEST_CASE("local bodies: images of points on sides are those of the whole body") {
  for (const bool moved : {false, true}) {
    const Bar bar({24, 31}, moved);
    const std::string text = scene_text(2, bar.body(), "low = \"x < 5.2\"\nsome = \"x > 8\"");
    compare_all(text + "[[boundary]]\nface = \"-x\"\ndisplacement = [0, \"free\"]\n[[symmetry]]\naxis = \"y\"\n");
  }
}
