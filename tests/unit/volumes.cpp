/// Volumes of points: Voronoi cells, clipped by the box and the shape of a body, and cells of lattices that the surface cuts.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <numeric>

#include "body/voronoi/voronoi.hpp"
#include "setup/body/body.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/fake_catalogue.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

Body body(const std::string& points, const std::string& family, const std::filesystem::path& folder = {}) {
  FakeCatalogue parts;
  const std::string text = SceneText{.body = "thickness = 2.0\n" + points, .family = "horizon_ratio = 3\n" + family, .integrator = "newton"};
  return build_body(parse_scene(text, folder / "disc.toml", parts));
}

double total(const Body& body) {
  double sum = 0;
  for (const std::int32_t p : body.internal()) sum += body.volume(static_cast<std::size_t>(p));
  return sum;
}

std::string refusal(const std::string& points, const std::string& family) {
  return message_of<InputError>([&] { body(points, family); });
}

const std::string disc = R"([body.lattice]
spacing = 0.1
lower = [-1, -1]
upper = [1, 1]
inside = "x^2 + y^2 < 1"
)";

}  // namespace

TEST_CASE("Voronoi cells of a lattice are its cells, those of any points fill the box") {
  for (int d = 1; d <= 3; ++d) {
    const int n = d == 1 ? 50 : d == 2 ? 12 : 6;
    const Point upper{1.0 * n, d > 1 ? 1.0 * n : 0, d > 2 ? 1.0 * n : 0};
    for (const double jitter : {0.0, 0.4}) {
      std::vector<Point> points;
      for (int k = 0; k < (d > 2 ? n : 1); ++k)
        for (int j = 0; j < (d > 1 ? n : 1); ++j)
          for (int i = 0; i < n; ++i) {
            Point x{i + 0.5, d > 1 ? j + 0.5 : 0, d > 2 ? k + 0.5 : 0};
            for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c)
              x[c] += jitter * std::sin(12.9 * i + 78.2 * j + 37.7 * k + 5.1 * static_cast<double>(c));
            points.push_back(x);
          }
      const VoronoiCells cells = voronoi_cells(points, d, {}, upper, true);
      const double sum = std::accumulate(cells.size.begin(), cells.size.end(), 0.0);
      CHECK(std::abs(sum - std::pow(n, d)) <= 1e-9 * sum);
      const auto [least, most] = std::minmax_element(cells.size.begin(), cells.size.end());
      if (jitter == 0) {
        CHECK(std::abs(*least - 1) <= 1e-9);
        CHECK(std::abs(*most - 1) <= 1e-9);
        CHECK(std::abs(cells.reach[0] - 0.5 * std::sqrt(d)) <= 1e-9);
      } else {
        CHECK(*most > 1.2 * *least);
      }
      CHECK(cells.neighbours[0].size() >= static_cast<std::size_t>(d));
    }
  }
}

TEST_CASE("volume = voronoi fills the body, whatever the points, and a disc up to its edge") {
  const std::string square =
      "[body.lattice]\nspacing = 0.1\nlower = [-1, -1]\nupper = [1, 1]\njitter = 0.3\nvolume = \"voronoi\"\n";
  CHECK(std::abs(total(body(square, "")) - 8) <= 1e-9);
  const double area = std::numbers::pi * 2, rough = total(body(disc + "jitter = 0.3\n", "")),
               fine = total(body(disc + "jitter = 0.3\nvolume = \"voronoi\"\n", ""));
  MESSAGE("disc of ", area, ": ", rough, " by cells of the lattice, ", fine, " by Voronoi cells");
  CHECK(std::abs(fine - area) < 2e-3 * area);
}

TEST_CASE("Voronoi cells that reach far into a hole keep what of them lies inside") {
  const std::string ring =
      "[body.lattice]\nspacing = 0.03125\nlower = [0, 0]\nupper = [2, 2]\ninside = \"x^2 + y^2 > 1 && x^2 + y^2 < 4\"\njitter = 0.3\nvolume = \"voronoi\"\n";
  const Body quarter = body(ring, "");
  double least = 1;
  for (const std::int32_t p : quarter.internal()) least = std::min(least, quarter.volume(static_cast<std::size_t>(p)));
  const double area = 2 * 0.75 * std::numbers::pi;
  MESSAGE("quarter of a ring of ", area, ": ", total(quarter), ", least cell ", least / (2 * 0.03125 * 0.03125), " of a lattice's");
  CHECK(least > 0.05 * 2 * 0.03125 * 0.03125);
  CHECK(std::abs(total(quarter) - area) < 2e-3 * area);
}

TEST_CASE("a point file needs no volumes where they come from Voronoi cells") {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "cloud.csv") << "x,y\n0.5,0.5\n1.5,0.5\n0.5,1.5\n1.5,1.5\n";
  const Body square = body("[body.points]\nfile = \"cloud.csv\"\nvolume = \"voronoi\"\n", "", folder.path);
  CHECK(std::abs(total(square) - 8) <= 1e-9);
  CHECK(std::abs(square.spacing() - 1) <= 1e-9);
  const Body wide =
      body("[body.points]\nfile = \"cloud.csv\"\nvolume = \"voronoi\"\nlower = [0, 0]\nupper = [3, 2]\n", "", folder.path);
  CHECK(std::abs(total(wide) - 12) <= 1e-9);
  const Body cut =
      body("[body.points]\nfile = \"cloud.csv\"\nvolume = \"voronoi\"\nlower = [0, 0]\nupper = [3, 2]\ninside = \"x < 2.5\"\n",
           "", folder.path);
  CHECK(std::abs(total(cut) - 10) <= 0.02 * 10);
}

TEST_CASE("partial_volume counts what of a cell lies inside") {
  const double area = std::numbers::pi * 2, stairs = total(body(disc, "")), cut = total(body(disc, "partial_volume = true"));
  MESSAGE("disc of ", area, ": ", stairs, " by whole cells, ", cut, " by parts of cells");
  // Cells with less than half of their volume inside have no point; their neighbours have what of them is inside.
  CHECK(std::abs(cut - area) < 1e-3 * area);
  const Body half =
      body("[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\ninside = \"x < 0.875\"\n", "partial_volume = true");
  CHECK(half.points() == 90);
  CHECK(std::abs(total(half) - 2 * 0.875) <= 2e-3);
  // Points lie at the centroid of what they stand for.
  const Body thin = body("[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\ninside = \"x < 0.825\"\n", "partial_volume = true");
  CHECK(thin.points() == 80);
  CHECK(std::abs(total(thin) - 2 * 0.825) <= 2e-3);
  double last = 0, moment = 0;
  for (const std::int32_t p : thin.internal()) {
    const double x = thin.position(static_cast<std::size_t>(p))[0];
    last = std::max(last, x);
    moment += thin.volume(static_cast<std::size_t>(p)) * x;
  }
  CHECK(std::abs(last - 0.7625) <= 1e-3);
  CHECK(std::abs(moment - 0.825 * 0.825) <= 1e-3);
}

TEST_CASE("an oblique surface cuts cells alike wherever it lies: rounding chooses no share and no heir") {
  const auto cut = [](const std::string& inside) {
    const Body square = body("[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\ninside = \"" + inside + "\"\n", "partial_volume = true");
    std::map<int, int> points_with;   // thousandths of a cell -> points
    for (const std::int32_t p : square.internal()) ++points_with[static_cast<int>(std::lround(square.volume(static_cast<std::size_t>(p)) * 1000 / 0.02))];
    return points_with;
  };
  // Through the corners of cells: half of each is inside.
  for (const char* inside : {"x + y < 1", "x + y <= 1", "y < 1 - x", "10*x + 10*y < 10"}) {
    CAPTURE(inside);
    CHECK(cut(inside) == std::map<int, int>{{500, 10}, {1000, 45}});
  }
  for (const char* inside : {"x - y < 0.1", "y - x < 0.1"}) {
    CAPTURE(inside);
    CHECK(cut(inside) == std::map<int, int>{{500, 9}, {1000, 55}});
  }
  // Through their centres and sides: an eighth goes to the cell below and to that beside, which are equally near.
  CHECK(cut("x + y < 0.35") == std::map<int, int>{{1000, 4}, {1063, 2}});
}

TEST_CASE("keys about volumes that would change nothing are refused") {
  CHECK(refusal(disc + "volume = \"voronoi\"\n", "")
            .find("body.lattice.volume: found \"voronoi\" on a lattice; allowed: \"cell\"") != std::string::npos);
  CHECK(refusal(disc + "jitter = 0.1\n", "partial_volume = true")
            .find("family.partial_volume: found true on a cloud; allowed: a lattice without jitter") != std::string::npos);
  CHECK(refusal("[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\n", "partial_volume = true")
            .find("family.partial_volume: found true on a lattice that nothing cuts") != std::string::npos);
}
