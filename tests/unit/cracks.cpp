// What cracks leave: their area, their extent, and the pieces with their masses.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "files/atomic_file.hpp"
#include "output/result_file.hpp"
#include "tests/kit/runs.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// A plate of 2 x 1, 0.25 thick, whose halves are pulled apart along x = 1: the bonds between them are weak. `more` goes into the lists.
std::string torn_plate(const std::string& more) {
  return "format = 1\n[constants]\ndx = 0.05\n[body]\ndimension = 2\nplane = \"stress\"\nthickness = 0.25\n[body.lattice]\nspacing = \"dx\"\nlower = [0, 0]\n"
         "upper = [2, 1]\n[sets]\nright = \"x > 0.6\"\n[family]\nhorizon_ratio = 3.015\n[kinematics]\ntype = \"bond_based\"\n"
         "[material]\ntype = \"linear_elastic\"\ndensity = 1000.0\nyoungs_modulus = 1e6\npoisson_ratio = 0.3333333333333333\n"
         "[[region]]\nset = \"right\"\nmaterial = { type = \"linear_elastic\", density = 1000.0, youngs_modulus = 1e6, poisson_ratio = 0.3333333333333333 }\n"
         "[damage]\ntype = \"critical_stretch\"\nstretch = 10.0\n[[interface]]\nbetween = [\"right\", \"rest\"]\n"
         "damage = { type = \"critical_stretch\", stretch = 1e-4 }\n[initial]\nvelocity = [\"x > 0.6 ? 1 : -1\", 0]\n"
         "[integrator]\ntype = \"verlet\"\nend_time = 4e-3\n[output]\nfields = [\"fragment\", \"damage\"]\nframes = 1\nhistory = [" +
         more + "]\n";
}

}  // namespace

TEST_CASE("a plate that tears in two: the area of the crack, its extent, and two pieces with their masses") {
  const TemporaryFolder folder;
  const auto columns = columns_of(
      torn_plate("{ name = \"area\", quantity = \"damage\", reduce = \"area\" },"
                 "{ name = \"length\", quantity = \"damage\", reduce = \"extent\", above = 0.2, direction = [0, 1] },"
                 "{ name = \"tip\", quantity = \"damage\", reduce = \"tip\", above = 0.2, direction = [0, -1] },"
                 "{ name = \"pieces\", quantity = \"fragment\", reduce = \"max\" },"
                 "{ name = \"largest\", quantity = \"fragment\", reduce = \"mass\", piece = 1 },"
                 "{ name = \"second\", quantity = \"fragment\", reduce = \"mass\", piece = 2 },"
                 "{ name = \"third\", quantity = \"fragment\", reduce = \"mass\", piece = 3 },"
                 "{ name = \"released\", value = \"dissipated_energy/area\" }, { name = \"never\", value = \"third/third\" }"),
      folder.path);
  const auto first = [&](const char* name) { return columns.at(name).front(); };
  const auto last = [&](const char* name) { return columns.at(name).back(); };
  CHECK(first("area") == 0);
  CHECK(last("area") == doctest::Approx(1 * 0.25).epsilon(0.05));   // of a cut along the lattice; own families at both ends
  CHECK(first("length") == 0);
  CHECK(last("length") == doctest::Approx(1 - 0.05).epsilon(1e-9));  // between the outermost points
  CHECK(std::isnan(first("tip")));
  CHECK(last("tip") == doctest::Approx(-0.025).epsilon(1e-9));
  CHECK(first("pieces") == 1);
  CHECK(last("pieces") == 2);
  CHECK(first("largest") == doctest::Approx(1000 * 2 * 0.25).epsilon(1e-12));
  CHECK(last("largest") == doctest::Approx(1000 * 1.4 * 0.25).epsilon(1e-12));
  CHECK(last("second") == doctest::Approx(1000 * 0.6 * 0.25).epsilon(1e-12));
  CHECK(last("third") == 0);
  CHECK(std::isnan(first("released")));
  // 0/0 at the start is as it should be; where it stays so there is something to say.
  const std::string log = read_text(folder.path / "run.log");
  CHECK(log.find("history column released") == std::string::npos);
  CHECK_MESSAGE(log.find("warning: history column never: third/third is no finite number at t = ") != std::string::npos, log);
  CHECK(log.find("at t = 0, where third") == std::string::npos);
  CHECK(last("released") == doctest::Approx(columns.at("dissipated_energy").back() / last("area")).epsilon(1e-12));
  // The larger piece has the number 1, wherever it lies.
  const LastFrame frame(folder.path, 800);
  std::vector<std::int64_t> points{0, 11, 12, 799};
  std::vector<double> numbers;
  frame.each_row("fragment", points, [&](std::size_t, std::span<const double> row) { numbers.push_back(row[0]); });
  CHECK(numbers == std::vector<double>{2, 2, 1, 1});
}

TEST_CASE("pre-cracks are no area of the run, and belong to the extent") {
  const TemporaryFolder folder;
  std::string scene = torn_plate("{ name = \"area\", quantity = \"damage\", reduce = \"area\" },"
                                 "{ name = \"length\", quantity = \"damage\", reduce = \"extent\", above = 0.2, direction = [0, 1] },"
                                 "{ name = \"pieces\", quantity = \"fragment\", reduce = \"max\" }");
  scene += "[[crack]]\nsegment = [[0.6, -0.1], [0.6, 0.5]]\n";
  const auto columns = columns_of(scene, folder.path);
  CHECK(columns.at("area").front() == 0);
  CHECK(columns.at("area").back() == doctest::Approx(0.5 * 0.25).epsilon(0.06));
  CHECK(columns.at("length").front() == doctest::Approx(0.5 - 0.05).epsilon(0.15));
  CHECK(columns.at("length").back() == doctest::Approx(1 - 0.05).epsilon(1e-9));
  CHECK(columns.at("pieces").front() == 1);
  CHECK(columns.at("pieces").back() == 2);
}
