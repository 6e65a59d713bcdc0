/// Parts of a lattice that ranks place by themselves are those that they cut out of the whole body, to the last number.

#include "build/local_body.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <mutex>

#include "body/input_numbers.hpp"
#include "perikit/build/body.hpp"
#include "perikit/core/serial_communicator.hpp"
#include "tests/thread_ranks.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

std::string scene_text(int dimension, const std::string& upper, const std::string& inside, const std::string& sets) {
  const std::string lower = dimension == 3 ? "[0, 0, 0]" : dimension == 2 ? "[0, 0]" : "[0]";
  return fmt::format(R"(format = 1
[body]
dimension = {}
{}
[body.lattice]
spacing = 1.0
lower = {}
upper = {}
{}
[sets]
{}
[[region]]
set = "low"
material = {{ type = "neo_hookean", shear_modulus = 2.0, bulk_modulus = 2.0 }}
[[region]]
set = "some"
material = {{ type = "neo_hookean", shear_modulus = 3.0, bulk_modulus = 2.0 }}
[family]
horizon_ratio = 2.015
[kinematics]
type = "baqp"
[material]
type = "neo_hookean"
shear_modulus = 1.0
bulk_modulus = 2.0
[integrator]
type = "newton"
)",
                     dimension,
                     dimension == 2   ? "plane = \"strain\""
                     : dimension == 1 ? "line = \"strain\""
                                      : "",
                     lower, upper, inside.empty() ? "" : fmt::format("inside = \"{}\"", inside), sets);
}

/// Of each rank: expressions are evaluated by one thread at a time.
Scene parsed(const std::string& text) {
  FakeCatalogue parts;
  return parse_scene(text, "body.toml", parts);
}

template <class A, class B>
bool same(const A& a, const B& b) {
  return std::ranges::equal(a, b);
}

void compare(const std::string& text, int ranks, const Partition::Reach& reach) {
  INFO(ranks, " ranks, ", reach.bonds, " bonds", std::string(reach.blocks ? ", whole blocks" : ""));
  std::mutex one;
  std::int64_t points = 0, all = 0;
  on_ranks(ranks, [&](ThreadRank&) {
    constexpr std::uint16_t far = 7;
    const Scene scene = parsed(text);
    Partition whole(build_body(scene), reach);
    const Body expected = whole.make_part(far);
    std::optional<LocalBody> local = build_local_body(scene, reach, far);
    const std::lock_guard lock(one);
    REQUIRE(local);
    const Body& found = local->body;
    CHECK(local->partition->whole() == nullptr);
    CHECK(same(found.internal(), expected.internal()));
    CHECK(found.stride() == expected.stride());
    CHECK(found.stride_of_all_ranks() == expected.stride_of_all_ranks());
    CHECK(found.points_of_all_ranks() == expected.points_of_all_ranks());
    CHECK(same(found.owned(), expected.owned()));
    CHECK(same(found.complete(), expected.complete()));
    CHECK(same(found.material_ids(), expected.material_ids()));
    CHECK(same(found.places().place, expected.places().place));
    CHECK(found.sets() == expected.sets());
    for (const auto& [name, members] : found.sets()) CHECK(same(found.order_of(name), expected.order_of(name)));
    CHECK(local->partition->points() == whole.points());
    CHECK(local->partition->lent() == whole.lent());
    CHECK(local->partition->borrowed() == whole.borrowed());
    for (const std::int32_t index : found.internal()) {
      const auto p = static_cast<std::size_t>(index);
      REQUIRE(found.number(p) == expected.number(p));
      REQUIRE(found.find(found.number(p)) == index);
      REQUIRE(found.at_place(found.places().place[p]) == index);
      REQUIRE(found.position(p) == expected.position(p));
      REQUIRE(found.volume(p) == expected.volume(p));
      REQUIRE(found.owns(p) == expected.owns(p));
    }
    points += std::ssize(found.owned());
    all = static_cast<std::int64_t>(found.points_of_all_ranks());
  });
  CHECK(points == all);
}

}  // namespace

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
        shape.dimension, shape.upper, shape.inside,
        fmt::format(
            "low = \"x < 5.2\"\nsome = {{ nearest = {} }}\nlisted = {{ points = [90, 3, 250, 17] }}\nfew = {{ points = [2, 5] }}",
            place));
    for (const int ranks : {2, 3, 5})
      for (const Partition::Reach& reach : {Partition::Reach{2, false}, {3, false}, {2, true}}) compare(text, ranks, reach);
  }
}

TEST_CASE("local bodies: what no point has is refused on all ranks, and so are idle ranks") {
  const auto on = [](int ranks, const std::string& text) {
    on_ranks(ranks, [&](ThreadRank&) { build_local_body(parsed(text), {}, 7); });
  };
  CHECK_THROWS_WITH(on(3, scene_text(2, "[40, 30]", "", "low = \"x < 5\"\nsome = \"x > 50\"")),
                    doctest::Contains("found a condition that holds at no point"));
  CHECK_THROWS_WITH(on(3, scene_text(2, "[40, 30]", "x > 50", "low = \"x < 5\"\nsome = \"x > 9\"")),
                    doctest::Contains("found an expression that keeps no point"));
  CHECK_THROWS_WITH(on(3, scene_text(2, "[40, 30]", "", "low = \"x < 5\"\nsome = { points = [1200] }")),
                    doctest::Contains("allowed: 0 to 1199"));
  CHECK_THROWS_WITH(on(40, scene_text(1, "[200]", "", "low = \"x < 5\"\nsome = \"x > 9\"")),
                    doctest::Contains("found 40 ranks for a body of 200 points"));
}

TEST_CASE("local bodies: a lattice that is almost empty is a cloud, which no rank places in part") {
  on_ranks(2, [&](ThreadRank&) {
    CHECK_FALSE(build_local_body(parsed(scene_text(2, "[60, 60]", "x + y < 20", "low = \"x < 5\"\nsome = \"x > 6\"")), {}, 7));
  });
}

namespace {

constexpr std::int64_t side = 1300;  // more than 2^31 cells in space
const std::string large = "[1300, 1300, 1300]", sets = "low = \"x < 5\"\nsome = \"x > 1290\"";

}  // namespace

TEST_CASE("local bodies: more points than 32 bits can number are refused on one rank, and placed in part") {
  const Scene scene = parsed(scene_text(3, large, "", sets));
  CHECK_FALSE(one_rank_holds(scene));
  CHECK(one_rank_holds(parsed(scene_text(3, "[100, 100, 100]", "", sets))));
  CHECK_THROWS_WITH(build_body(scene), doctest::Contains("on a rank; explicit runs of a lattice share it out"));
  constexpr int ranks = 8192;
  LoneRank last(ranks - 1, ranks);
  const CommunicatorScope scope(last);
  std::optional<LocalBody> local = build_local_body(scene, {}, 7);
  REQUIRE(local);
  const Body& body = local->body;
  CHECK(body.points_of_all_ranks() == static_cast<std::size_t>(side * side * side));
  const auto p = static_cast<std::size_t>(body.owned().back());
  CHECK(body.position(p) == Point{side - 0.5, side - 0.5, side - 0.5});
  CHECK(body.places().place[p] > std::int64_t{1} << 31);
  CHECK(body.at_place(body.places().place[p]) == body.owned().back());
  CHECK(heaviest_rank(scene, ranks) >= 0);
}

TEST_CASE("local bodies: a part that is too large is refused, and so are more points than ranks can name") {
  LoneRank first(0, 2);
  const CommunicatorScope scope(first);
  const auto refused = [](const std::string& upper) {
    const Scene scene = parsed(scene_text(3, upper, "", sets));
    try {
      build_local_body(scene, {}, 7);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(refused("[100000, 10000, 10000]").find("points on a rank with a horizon of 2.015 spacings, which need") !=
        std::string::npos);
  CHECK_THROWS_WITH(parsed(scene_text(3, "[1e6, 1e6, 1e6]", "", sets)),
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
