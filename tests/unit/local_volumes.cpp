/// Voronoi cells that ranks find of their own points are those of the whole cloud, in every bit.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <fstream>
#include <mutex>
#include <numeric>

#include "body/voronoi/voronoi.hpp"
#include "perikit/core/rank_values.hpp"
#include "unit/cloud_files.hpp"
#include "unit/part_comparison.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// Of points in the box from the origin to `upper`.
void compare_cells(const std::string& what, const std::vector<Point>& points, int dimension, const Point& upper) {
  INFO(what, ", ", dimension, "D");
  const VoronoiCells whole = voronoi_cells(points, dimension, {}, upper, true);
  const auto sorted = [](std::vector<std::int64_t> numbers) {
    std::ranges::sort(numbers);
    return numbers;
  };
  for (const int ranks : {1, 2, 3, 7}) {
    std::mutex one;
    std::size_t cells = 0;
    on_ranks(ranks, [&](ThreadRank&) {
      const Run run = own_run(std::ssize(points));
      const SharedCells found =
          shared_voronoi_cells({points.begin() + run.first, points.begin() + run.last}, dimension, {}, upper, true);
      const std::lock_guard lock(one);
      cells += found.cells.size.size();
      bool same_sizes = true, same_reach = true, same_neighbours = true;
      for (std::size_t n = 0; n < found.cells.size.size(); ++n) {
        const auto number = static_cast<std::size_t>(found.numbers[n]);
        same_sizes = same_sizes && found.cells.size[n] == whole.size[number] && found.points[n] == points[number];
        same_reach = same_reach && found.cells.reach[n] == whole.reach[number];
        std::vector<std::int64_t> neighbours;
        for (const std::int32_t other : found.cells.neighbours[n])
          neighbours.push_back(found.numbers[static_cast<std::size_t>(other)]);
        same_neighbours =
            same_neighbours && sorted(neighbours) == sorted({whole.neighbours[number].begin(), whole.neighbours[number].end()});
      }
      CHECK(same_sizes);
      CHECK(same_reach);
      CHECK(same_neighbours);
    });
    CHECK(cells == points.size());
  }
}

/// The points of a regular lattice for which `keep` is true.
template <class Keep>
std::vector<Point> regular(int n, int dimension, Keep&& keep) {
  std::vector<Point> points;
  for (int k = 0; k < (dimension > 2 ? n : 1); ++k)
    for (int j = 0; j < (dimension > 1 ? n : 1); ++j)
      for (int i = 0; i < n; ++i) {
        const Point x{i + 0.5, dimension > 1 ? j + 0.5 : 0.0, dimension > 2 ? k + 0.5 : 0.0};
        if (keep(x)) points.push_back(x);
      }
  return points;
}

double square(const Point& x, double middle) {
  double sum = 0;
  for (const double value : x) sum += value == 0 ? 0 : (value - middle) * (value - middle);
  return sum;
}

}  // namespace

TEST_CASE("local volumes: cells of points at random places, and far from all others, are those of the whole cloud") {
  for (const int d : {1, 2, 3}) {
    const Point upper{d == 1 ? 3000.0 : d == 2 ? 60.0 : 14.0, d > 1 ? 50.0 : 0.0, d > 2 ? 12.0 : 0.0};
    PointCloud cloud = random_points(2000, upper, static_cast<unsigned>(d));
    compare_cells("random points", cloud.position, d, upper);
    for (Point& x : cloud.position)
      for (std::size_t c = 0; c < 3; ++c) x[c] = upper[c] * std::pow(x[c] / std::max(upper[c], 1e-9), 5);
    compare_cells("points that are denser on one side", cloud.position, d, upper);
    compare_cells("few points", {cloud.position.begin(), cloud.position.begin() + 5}, d, upper);
  }
}

TEST_CASE("local volumes: cells of regular lattices with holes, whose corners many points touch, are those of the whole cloud") {
  const auto around = [](double from, double to) {
    return [=](const Point& x) { return square(x, 10) > from * from && square(x, 10) < to * to; };
  };
  for (const int d : {1, 2, 3}) {
    const Point upper{20, d > 1 ? 20.0 : 0.0, d > 2 ? 20.0 : 0.0};
    compare_cells("a lattice", regular(20, d, around(-1, 100)), d, upper);
    compare_cells("a hole", regular(20, d, around(7, 100)), d, upper);
    compare_cells("a ball", regular(20, d, around(-1, 8)), d, upper);
    compare_cells("a shell", regular(20, d, around(7, 9.2)), d, upper);
  }
}

TEST_CASE("local volumes: clouds of Voronoi cells are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside;
  };
  const std::string keys = "jitter = 0.3\nvolume = \"voronoi\"", sets = "low = \"x < 5.2\"\nsome = \"x > 8\"";
  for (const Shape& shape : {Shape{1, "[2000]", ""},
                             {1, "[2000]", "x < 100 || x > 130"},
                             {2, "[61, 53]", ""},
                             {2, "[41, 37]", "(x - 24)^2 + (y - 20)^2 > 100 && x + y > 9"},
                             {3, "[16, 14, 12]", ""},
                             {3, "[11, 10, 12]", "(x - 4)^2 + (y - 5)^2 + (z - 6)^2 > 12 && x < 9.5"}}) {
    INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside));
    const std::string text = scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside, keys), sets);
    compare(text, 2, {2, false});
    compare(text, 3, {3, true});
    if (shape.dimension == 2) compare(text + "[[symmetry]]\naxis = \"x\"\n", 3, {2, false, true});
  }
}

TEST_CASE(
    "local volumes: clouds of files without volumes are those of the whole body, and wrong ones are refused as on one rank") {
  const TemporaryFolder folder;
  const std::string sets = "low = \"x < 5.2\"\nsome = \"x > 8\"";
  for (const int d : {1, 2, 3}) {
    const Point size = d == 1 ? Point{3000, 0, 0} : d == 2 ? Point{60, 50, 0} : Point{16, 14, 12};
    const PointCloud cloud = random_points(2000, size, 4);
    std::ofstream(folder.path / "cloud.csv", std::ios::binary) << csv(cloud, d);
    write_hdf5(folder.path / "cloud.h5", cloud, d);
    for (const char* name : {"cloud.csv", "cloud.h5"})
      compare(scene_text(d, file_body(folder.path / name) + "volume = \"voronoi\"\n", sets), 3, {2, true});
  }
  const std::string body = file_body(folder.path / "cloud.csv") + "volume = \"voronoi\"\n";
  for (const char* keys : {"inside = \"x < 12\"\n", "lower = [0, 0, 3]\n", "upper = [9, 20, 20]\n", "inside = \"0 > 1\"\n"}) {
    INFO(std::string(keys));
    const std::string text = scene_text(3, body + keys, sets), expected = message_on(1, [&] { build_body(parsed(text)); });
    CHECK_FALSE(expected.empty());
    for (const int ranks : {2, 5}) CHECK(message_on(ranks, [&] { build_local_body(parsed(text), {}, 7); }) == expected);
  }
  // Of a part of the body, too.
  compare(scene_text(3, body + "lower = [-1, -1, -1]\nupper = [17, 15, 13]\ninside = \"x + y > -0.4\"\n", sets), 3, {2, false});
}
