/// Parts of a body that ranks place by themselves are those that they cut out of the whole body, to the last number.

#include "setup/body/local_body.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <mutex>

#include "body/partition/input_order.hpp"
#include "body/partition/point_share.hpp"
#include "core/ranks/serial_communicator.hpp"
#include "perikit/core/memory.hpp"
#include "setup/body/body.hpp"
#include "setup/body/points_of_cloud.hpp"
#include "setup/body/scene_lattice.hpp"
#include "setup/body/several_ranks.hpp"
#include "setup/surfaces/image_planes.hpp"
#include "unit/cloud_files.hpp"
#include "unit/part_comparison.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

TEST_CASE("local bodies: each rank's own part is that of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside;
  };
  // The last rows of some shapes are shorter or missing, and the longest side is not always the first one.
  for (const Shape& shape : {Shape{1, "[2000]", ""},
                             {1, "[2000]", "x < 100 || x > 130"},
                             {2, "[40, 33]", ""},
                             {2, "[31, 47]", "(x - 14)^2 + (y - 20)^2 > 40 && x + y > 9"},
                             {3, "[16, 14, 12]", ""},
                             {3, "[12, 19, 26]", "(x - 6)^2 + (y - 9)^2 + (z - 9)^2 > 20"},
                             {3, "[9, 40, 11]", "y < 17 || z < 4"},
                             {3, "[40, 5, 30]", "x > 3 || z > 12"}}) {
    INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside));
    const std::string place = shape.dimension == 3 ? "[6, 7, 5]" : shape.dimension == 2 ? "[15.2, 21]" : "[115]";
    const std::string text = scene_text(
        shape.dimension, lattice(shape.dimension, shape.upper, shape.inside),
        fmt::format(
            "low = \"x < 5.2\"\nsome = {{ nearest = {} }}\nlisted = {{ points = [90, 3, 250, 17] }}\nfew = {{ points = [2, 5] }}",
            place));
    for (const int ranks : {2, 3, 5})
      for (const Partition::Reach& reach : {Partition::Reach{2, false}, {3, false}, {2, true}}) compare(text, ranks, reach);
  }
}

TEST_CASE("local bodies: parts of lattices with images are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside, *beyond;
  };
  const char *symmetry = "[[symmetry]]\naxis = \"x\"\n", *corner = "[[symmetry]]\naxis = \"x\"\n[[symmetry]]\naxis = \"y\"\n",
             *periodic = "[[periodic]]\naxis = \"y\"\n", *around = "[[periodic]]\naxis = \"x\"\n[[periodic]]\naxis = \"y\"\n",
             *between = "[[symmetry]]\naxis = \"y\"\n[[symmetry]]\naxis = \"y\"\nat = 3.0\n",
             *face = "[[boundary]]\nface = \"+x\"\nset = \"all\"\ndisplacement = [0, \"free\"]\n",
             *of_part = "[[boundary]]\nface = \"-y\"\nset = \"low\"\ndisplacement = [0, 0]\n[[symmetry]]\naxis = \"x\"\n";
  for (const Shape& shape : {Shape{1, "[2000]", "", symmetry},
                             {1, "[2000]", "", "[[periodic]]\naxis = \"x\"\n"},
                             {2, "[40, 33]", "", corner},
                             {2, "[31, 47]", "(x - 14)^2 + (y - 20)^2 > 40 && x + y > 9", corner},
                             {2, "[31, 47]", "(x - 14)^2 + (y - 2)^2 > 40", face},
                             {2, "[31, 47]", "(x - 14)^2 + (y - 2)^2 > 40", periodic},
                             {2, "[31, 47]", "", around},
                             {2, "[1200, 3]", "", between},
                             {2, "[1200, 2]", "", periodic},
                             {2, "[31, 47]", "x < 20 || y > 6", of_part},
                             {3, "[16, 14, 12]", "", corner},
                             {3, "[12, 19, 26]", "(x - 6)^2 + (y - 9)^2 + (z - 9)^2 > 20", around},
                             {3, "[40, 5, 30]", "x > 3 || z > 12", periodic}}) {
    INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside), ", ", std::string(shape.beyond));
    const std::string place = shape.dimension == 3 ? "[6, 7, 5]" : shape.dimension == 2 ? "[15.2, 21]" : "[115]";
    const std::string text = scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside),
                                        fmt::format("low = \"x < 5.2\"\nsome = {{ nearest = {} }}\nlisted = {{ points = [90, 3, 250, 17] }}", place)) +
                             shape.beyond;
    for (const int ranks : {2, 3, 5})
      for (const Partition::Reach& reach : {Partition::Reach{2, false}, {3, false}, {2, true}, {2, false, true}}) compare(text, ranks, reach);
  }
}

TEST_CASE("local bodies: sides of lattices that cannot have images are refused on all ranks as on one") {
  const auto message = [](const std::string& text, int ranks) {
    return message_on(ranks, [&] {
      const Scene scene = parsed(text);
      if (ranks > 1) {
        build_local_body(scene, {}, 7);
        return;
      }
      const Body body = build_body(scene);
      const ScenePlanes planes = build_planes(scene, placed_points(body), false);
      try {
        Body(body, make_images(body, planes.planes), 3);
      } catch (const OverlappingImage& error) {
        refuse_overlap(planes, error);
      }
    });
  };
  const std::string sets = "low = \"x < 5\"\nsome = \"x > 9\"";
  for (const char* wrong : {"[[symmetry]]\naxis = \"x\"\nat = 7.0\n", "[[symmetry]]\naxis = \"x\"\nat = -7.0\n", "[[periodic]]\naxis = \"y\"\nupper = 25.0\n",
                            "[[boundary]]\nface = \"+x\"\nset = \"low\"\ndisplacement = [0, 0]\n",
                            "[[boundary]]\nface = \"+x\"\nat = 9.0\nset = \"low\"\ndisplacement = [0, 0]\n"}) {
    INFO(std::string(wrong));
    for (const char* inside : {"", "x + y > 6"}) {
      const std::string text = scene_text(2, lattice(2, "[40, 30]", inside), sets) + wrong, expected = message(text, 1);
      CHECK_FALSE(expected.empty());
      for (const int ranks : {2, 3}) CHECK(message(text, ranks) == expected);
    }
  }
}

TEST_CASE("local bodies: what no point has is refused on all ranks, and so are idle ranks") {
  const auto on = [](int ranks, const std::string& text) {
    on_ranks(ranks, [&](ThreadRank&) { build_local_body(parsed(text), {}, 7); });
  };
  CHECK_THROWS_WITH(on(3, scene_text(2, lattice(2, "[40, 30]", ""), "low = \"x < 5\"\nsome = \"x > 50\"")),
                    doctest::Contains("found a condition that holds at no point"));
  CHECK_THROWS_WITH(on(3, scene_text(2, lattice(2, "[40, 30]", "x > 50"), "low = \"x < 5\"\nsome = \"x > 9\"")),
                    doctest::Contains("found an expression that keeps no point"));
  CHECK_THROWS_WITH(on(3, scene_text(2, lattice(2, "[40, 30]", ""), "low = \"x < 5\"\nsome = { points = [1200] }")),
                    doctest::Contains("allowed: 0 to 1199"));
  CHECK_THROWS_WITH(on(40, scene_text(1, lattice(1, "[200]", ""), "low = \"x < 5\"\nsome = \"x > 9\"")),
                    doctest::Contains("found 40 ranks for a body of 200 points"));
}

TEST_CASE("local bodies: clouds made from lattices are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside, *keys, *place;
  };
  for (const Shape& shape :
       {Shape{1, "[2000]", "", "jitter = 0.3", "[115]"},
        {1, "[3000]", "x < 100 || x > 130", "jitter = 0.2\nseed = 7", "[115]"},
        {2, "[61, 53]", "", "jitter = 0.4", "[15.2, 21]"},
        {2, "[51, 67]", "(x - 14)^2 + (y - 20)^2 > 40 && x + y > 9", "jitter = 0.2", "[15, 21]"},
        {2, "[300, 300]", "(x - 150)^2 + (y - 150)^2 > 147^2 && x + y < 420", "", "[3.5, 3.5]"},  // almost empty
        {3, "[16, 14, 12]", "", "jitter = 0.1", "[6, 7, 5]"},
        {3, "[12, 19, 26]", "(x - 6)^2 + (y - 9)^2 + (z - 9)^2 > 20", "jitter = 0.3", "[6, 7, 5]"}}) {
    INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside), ", ",
         std::string(shape.keys));
    compare_all(scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside, shape.keys),
                           fmt::format(fmt::runtime(cloud_sets), shape.place)));
  }
}

TEST_CASE("local bodies: cells that a surface cuts are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside, *place;
  };
  for (const Shape& shape : {Shape{1, "[2000]", "x < 1700.3 && x > 2.6", "[115]"},
                             {2, "[61, 53]", "(x - 14)^2 + (y - 20)^2 > 47 && x + 1.3*y > 9", "[15.2, 21]"},
                             {3, "[14, 15, 16]", "(x - 7)^2 + (y - 7)^2 + (z - 7)^2 < 45", "[6, 7, 5]"}}) {
    INFO(shape.dimension, "D, inside ", std::string(shape.inside));
    compare_all(scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside),
                           fmt::format(fmt::runtime(cloud_sets), shape.place), "horizon_ratio = 2.015\npartial_volume = true"));
  }
}

TEST_CASE("local bodies: clouds of files are those of the whole body, in whatever format") {
  const TemporaryFolder folder;
  for (const int dimension : {1, 2, 3}) {
    const Point size = dimension == 1 ? Point{3000, 0, 0} : dimension == 2 ? Point{60, 50, 0} : Point{16, 14, 12};
    const PointCloud cloud = random_points(dimension == 2 ? 3000 : 2800, size, 3);
    std::ofstream(folder.path / "cloud.csv", std::ios::binary) << csv(cloud, dimension);
    write_hdf5(folder.path / "cloud.h5", cloud, dimension);
    const std::string sets = fmt::format(fmt::runtime(cloud_sets), dimension == 3   ? "[6, 7, 5]"
                                                                   : dimension == 2 ? "[15.2, 21]"
                                                                                    : "[115]");
    for (const char* name : {"cloud.csv", "cloud.h5"}) {
      INFO(dimension, "D, ", std::string(name));
      compare_all(scene_text(dimension, file_body(folder.path / name), sets));
    }
  }
}

TEST_CASE("local bodies: clouds of odd shapes are those of the whole body") {
  const TemporaryFolder folder;
  const auto compare_points = [&](const std::string& what, const PointCloud& cloud, const std::string& family) {
    INFO(what);
    std::ofstream(folder.path / "odd.csv") << csv(cloud, 3);
    compare_all(scene_text(3, file_body(folder.path / "odd.csv"), "low = { points = [5, 3, 900] }\nsome = \"x > 0.5\"", family));
  };
  PointCloud cloud = random_points(1500, {12, 12, 12}, 5);
  compare_points("one cube of the curve, of which all ranks have a piece", cloud, "horizon = 40");
  compare_points("more cubes than points", cloud, "horizon = 1.3");
  for (Point& x : cloud.position) x[2] = 3;
  compare_points("all in one plane", cloud, "horizon = 2");
  cloud = random_points(1500, {12, 12, 12}, 6);
  cloud.position[700] = {1e9, -3e7, 1e8};
  cloud.position[900] = {-1e5, 0, 0};
  compare_points("points far away", cloud, "horizon = 2");
  // Bonds exactly as long as the horizon, and cubes whose faces points lie on.
  for (std::size_t n = 0; n < cloud.position.size(); ++n)
    cloud.position[n] = {0.1 * static_cast<double>(n % 10), 0.1 * static_cast<double>(n / 10 % 15),
                         0.1 * static_cast<double>(n / 150)};
  for (double& volume : cloud.volume) volume = 1e-3;
  compare_points("a lattice by hand", cloud, "horizon = 0.2");
}

TEST_CASE("local bodies: what is wrong with a file is said as on one rank, by all ranks") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path / "wrong.csv", other = folder.path / "wrong.h5";
  const auto message = [](const std::filesystem::path& from, int ranks) {
    return message_on(ranks, [&] { ranks == 1 ? read_points(from, 3) : read_run_of_points(from, 3); });
  };
  const auto same_for_ranks = [&](const std::filesystem::path& from) {
    const std::string expected = message(from, 1);
    CHECK_FALSE(expected.empty());
    for (const int ranks : {2, 3, 7}) CHECK(message(from, ranks) == expected);
  };
  const PointCloud cloud = random_points(300, {10, 10, 10}, 2);
  const std::string right = csv(cloud, 3);
  for (const std::string& wrong :
       {right + "\n1,2,3\n", right + "\n1,2,3,4,5\n", right + "\n-1,2,3,4\n", std::string("x,y,z\n1,2,3\n"),
        std::string("x,y,z,volume\n"), std::string(), std::string("# nothing\n\n"), std::string("x,y,z,volum\n"),
        right + "\n1,2,3,inf\n" + right, std::string(right).replace(right.size() / 2, 1, "?"),
        std::string(right).replace(right.size() / 5, 1, ","), std::string("x,y,z,volume\n1,1,1,1,1")}) {
    std::ofstream(file, std::ios::binary) << wrong;
    same_for_ranks(file);
  }
  same_for_ranks(folder.path / "none.csv");
  PointCloud spoiled = cloud;
  spoiled.volume[290] = 0;
  spoiled.position[170][1] = std::nan("");
  write_hdf5(other, spoiled, 3);
  same_for_ranks(other);
  write_hdf5(other, cloud, 2);
  same_for_ranks(other);
}

TEST_CASE("local bodies: clouds of no point, and of too few for the ranks, are refused on all ranks") {
  const auto on = [](int ranks, const std::string& text) {
    on_ranks(ranks, [&](ThreadRank&) { build_local_body(parsed(text), {}, 7); });
  };
  const std::string sets = "low = \"x < 5\"\nsome = \"x > 9\"";
  CHECK_THROWS_WITH(on(3, scene_text(2, lattice(2, "[40, 30]", "x > 50", "jitter = 0.1"), sets)),
                    doctest::Contains("found an expression that keeps no point"));
  CHECK_THROWS_WITH(on(3, scene_text(2, lattice(2, "[40, 30]", "x > 50"), sets, "horizon_ratio = 2\npartial_volume = true")),
                    doctest::Contains("found an expression that keeps no cell"));
  CHECK_THROWS_WITH(on(6, scene_text(2, lattice(2, "[12, 10]", "", "jitter = 0.1"), sets)),
                    doctest::Contains("found 6 ranks for a body of 120 points"));
  CHECK_THROWS_WITH(on(7, scene_text(1, lattice(1, "[3]", "", "jitter = 0.1"), sets)),
                    doctest::Contains("found 7 ranks for a body of 3 points"));
}

TEST_CASE("local bodies: a rank without others has the points that it has among them") {
  const std::string text = scene_text(3, lattice(3, "[16, 14, 12]", "", "jitter = 0.2"), "low = \"x < 5\"\nsome = \"x > 9\"");
  std::mutex one;
  on_ranks(3, [&](ThreadRank& rank) {
    const Scene scene = parsed(text);
    const LocalBody among = build_local_body(scene, {3, true}, 7);
    LoneRank lone(rank.rank(), 3);
    const CommunicatorScope scope(lone);
    const LocalBody alone = build_local_body(scene, {3, true}, 7);
    const std::lock_guard lock(one);
    CHECK(same(alone.body.places().place, among.body.places().place));
    CHECK(same(alone.body.owned(), among.body.owned()));
    CHECK(same(alone.body.material_ids(), among.body.material_ids()));
    CHECK(alone.partition->points() == among.partition->points());
  });
}

namespace {

constexpr std::int64_t side = 1300;  // more than 2^31 cells in space
const std::string large = "[1300, 1300, 1300]", sets = "low = \"x < 5\"\nsome = \"x > 1290\"";

}  // namespace

TEST_CASE("local bodies: more points than 32 bits can number are refused on one rank, and placed in part") {
  const Scene scene = parsed(scene_text(3, lattice(3, large, ""), sets));
  CHECK_FALSE(one_rank_holds(scene));
  CHECK(one_rank_holds(parsed(scene_text(3, lattice(3, "[100, 100, 100]", ""), sets))));
  CHECK_THROWS_WITH(build_body(scene), doctest::Contains("on a rank; explicit runs share it out"));
  constexpr int ranks = 8192;
  LoneRank last(ranks - 1, ranks);
  const CommunicatorScope scope(last);
  const LocalBody local = build_local_body(scene, {}, 7);
  const Body& body = local.body;
  CHECK(body.points_of_all_ranks() == static_cast<std::size_t>(side * side * side));
  const auto p = static_cast<std::size_t>(body.owned().back());
  CHECK(body.position(p) == Point{side - 0.5, side - 0.5, side - 0.5});
  CHECK(body.places().place[p] > std::int64_t{1} << 31);
  CHECK(body.at_place(body.places().place[p]) == body.owned().back());
  CHECK(heaviest_rank(scene, ranks) >= 0);
}

namespace {

/// Parts of five ranks that know of no others: of points that they keep, and of those that they go through.
void compare_streamed(const std::string& text, const Partition::Reach& reach) {
  const Scene scene = parsed(text);
  constexpr int ranks = 5;
  for (const int rank : {0, 3, 4}) {
    LoneRank lone(rank, ranks);
    const CommunicatorScope scope(lone);
    const CloudOutline cloud = cloud_outline(scene);
    const BodyFrame frame = scene_frame(scene, cloud.spacing);
    Partition streamed(frame, StreamedCloud(cloud.points, cloud.extent, frame.horizon), reach);
    Partition kept(frame, SharedCloud(cloud_points(scene, WhichPoints::run).points, frame.horizon), reach);
    const Body found = streamed.make_part(7), expected = kept.make_part(7);
    CHECK(streamed.points() == kept.points());
    CHECK(same(found.owned(), expected.owned()));
    CHECK(same(found.places().place, expected.places().place));
    CHECK(same(found.material_ids(), expected.material_ids()));
    CHECK(same(found.rows(), expected.rows()));
    const bool same_numbers = std::ranges::all_of(found.internal(), [&](std::int32_t p) {
      return found.number(static_cast<std::size_t>(p)) == expected.number(static_cast<std::size_t>(p));
    });
    CHECK(same_numbers);
  }
}

}  // namespace

TEST_CASE("local bodies: a rank without others that goes through the points of a cloud has the part that it has of all of them") {
  const TemporaryFolder folder;
  const std::string sets = "low = \"x < 5\"\nsome = \"x > 9\"";
  write_hdf5(folder.path / "cloud.h5", random_points(3000, {60, 50, 0}, 3), 2);
  std::ofstream(folder.path / "cloud.csv", std::ios::binary) << csv(random_points(3000, {60, 50, 0}, 3), 2);
  for (const Partition::Reach& reach : {Partition::Reach{2, false}, {2, true}, {3, true}}) {
    INFO(reach.bonds, " bonds", std::string(reach.blocks ? ", whole blocks" : ""));
    compare_streamed(scene_text(1, lattice(1, "[3000]", "x < 100 || x > 130", "jitter = 0.3"), sets), reach);
    compare_streamed(scene_text(2, lattice(2, "[61, 53]", "(x - 14)^2 + (y - 20)^2 > 40", "jitter = 0.2"), sets), reach);
    compare_streamed(scene_text(2, lattice(2, "[50, 60]", "x + y > 7.3"), sets, "horizon_ratio = 2.015\npartial_volume = true"),
                     reach);
    compare_streamed(scene_text(3, lattice(3, "[16, 14, 12]", "", "jitter = 0.1"), sets), reach);
    compare_streamed(scene_text(2, file_body(folder.path / "cloud.h5"), sets), reach);
    compare_streamed(scene_text(2, file_body(folder.path / "cloud.csv"), sets), reach);
  }
}

TEST_CASE("local bodies: a part that is too large is refused, and so are more points than ranks can name") {
  LoneRank first(0, 2);
  const CommunicatorScope scope(first);
  const auto refused = [](const std::string& upper) {
    const Scene scene = parsed(scene_text(3, lattice(3, upper, ""), sets));
    return message_of<InputError>([&] { build_local_body(scene, {}, 7); });
  };
  CHECK(refused("[100000, 10000, 10000]").find("points on a rank with a horizon of 2.015 spacings, which need") !=
        std::string::npos);
  CHECK_THROWS_WITH(parsed(scene_text(3, lattice(3, "[1e6, 1e6, 1e6]", ""), sets)),
                    doctest::Contains("allowed: a spacing that gives 1 to 4e+15 points"));
}

TEST_CASE("local bodies: input numbers of 64 bits are added up over ranks") {
  const Lattice lattice = make_lattice(3, 1, {0, 0, 0}, {side, side, side}, 2);
  const LatticeShares shares(lattice, points_in_tiles(lattice, {}), 3);
  std::mutex one;
  std::int64_t largest = 0;
  on_ranks(3, [&](ThreadRank& rank) {
    const CellBox box = shares.box(rank.rank());
    const std::vector<std::int64_t> counts(static_cast<std::size_t>(box.length(1) * box.length(2)), box.length(0));
    const std::vector<std::int64_t> numbers = first_numbers_of_rows(lattice, shares.boxes(), counts);
    const std::lock_guard lock(one);
    REQUIRE(numbers.size() == counts.size());
    bool right = true;
    std::size_t row = 0;
    for (std::int64_t z = box.low[2]; z < box.high[2]; ++z)
      for (std::int64_t y = box.low[1]; y < box.high[1]; ++y)
        right = right && numbers[row++] == box.low[0] + side * (y + side * z);
    CHECK(right);
    largest = std::max(largest, numbers.back());
  });
  CHECK(largest > std::int64_t{1} << 31);
}
