/// Parts of bodies with held surfaces, and held faces of single points: what lies beyond them is that of the whole body.

#include <doctest/doctest.h>

#include "unit/part_comparison.hpp"

using namespace perikit;
using namespace perikit::test;

TEST_CASE("local bodies: faces of sets that list points or take the nearest one are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside, *keys, *face, *listed, *place;
  };
  const char* jitter = "jitter = 0.2";
  for (const Shape& shape :
       {Shape{1, "[2000]", "", "", "+x", "[1999]", "[1999.6]"},
        {1, "[2000]", "x > 7", "", "+x", "[1992]", "[1999.6]"},
        {2, "[31, 47]", "", "", "+x", "[61, 30, 92, 557]", "[30.5, 20.5]"},
        {2, "[31, 47]", "x < 20 || y > 6", "", "+x", "[212, 150, 181]", "[30.5, 20]"},
        {2, "[300, 300]", "(x - 150)^2 + (y - 150)^2 > 147^2 && x + y < 420", "", "-x", "[2, 0, 7, 290]", "[0, 3]"},
        {2, "[31, 47]", "", jitter, "+x", "[61, 30, 92, 557]", "[30.5, 20.5]"},
        {2, "[31, 47]", "x < 20 || y > 6", jitter, "+x", "[212, 150, 181]", "[30.5, 20]"},
        {3, "[12, 19, 26]", "", "", "-z", "[3, 0, 200, 17]", "[4, 5, 0]"},
        {3, "[12, 19, 26]", "(x - 6)^2 + (y - 9)^2 + (z - 9)^2 > 20", jitter, "-z", "[3, 0, 200, 17]", "[4, 5, 0]"}})
    for (const bool nearest : {false, true}) {
      INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside), ", ",
           std::string(shape.keys), std::string(nearest ? ", the nearest point" : ", listed points"));
      const std::string chosen = nearest ? fmt::format("nearest = {}", shape.place) : fmt::format("points = {}", shape.listed);
      const std::string held = shape.dimension == 1 ? "[0]" : shape.dimension == 2 ? "[0, 0]" : "[0, 0, 0]";
      compare_all(scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside, shape.keys),
                             fmt::format("low = \"x < 9.2\"\nsome = \"x > 8\"\nside = {{ {} }}", chosen)) +
                  fmt::format("[[boundary]]\nface = \"{}\"\nset = \"side\"\ndisplacement = {}\n", shape.face, held));
    }
}

TEST_CASE("local bodies: faces of sets of no point, and of points that do not exist, are refused as on one rank") {
  const std::string sets = "low = \"x < 5\"\nsome = \"x > 9\"\n",
                    face = "[[boundary]]\nface = \"+x\"\nset = \"side\"\ndisplacement = [0, 0]\n";
  for (const char* side :
       {"side = \"x > 50\"", "side = { points = [3, 2000] }", "side = { points = [3, 7, 3] }", "side = { points = [-1] }"})
    for (const char* keys : {"", "jitter = 0.2"}) {
      INFO(std::string(side), ", ", std::string(keys));
      const std::string text = scene_text(2, lattice(2, "[40, 30]", "x + y > 6", keys), sets + side) + face;
      const std::string expected = message_on(1, [&] { build_body(parsed(text)); });
      CHECK_FALSE(expected.empty());
      for (const int ranks : {2, 3}) CHECK(message_on(ranks, [&] { build_local_body(parsed(text), {}, 7); }) == expected);
    }
}

namespace {

std::string held_surface(int dimension, const std::string& level) {
  const std::string held = dimension == 1 ? "[0]" : dimension == 2 ? "[0, 0]" : "[0, 0, 0]";
  return fmt::format("[[boundary]]\nsurface = \"{}\"\ndisplacement = {}\n", level, held);
}

const std::string cut = "horizon_ratio = 2.015\npartial_volume = true";

}  // namespace

TEST_CASE("local bodies: images beyond held surfaces are those of the whole body") {
  struct Shape {
    int dimension;
    const char *upper, *inside, *keys, *level, *beyond;
  };
  const char *jitter = "jitter = 0.2", *partial = "";
  const char *hole = "(x - 14)^2 + (y - 20)^2 > 64", *rim = "8 - sqrt((x - 14)^2 + (y - 20)^2)",
             *side = "-0.2 - x + 0.001*(y - 10)^2";
  const char *symmetry = "[[symmetry]]\naxis = \"y\"\n", *periodic = "[[periodic]]\naxis = \"y\"\n";
  const char *crack = "[[crack]]\nsegment = [[27.0, 3.2], [29.0, 9.1]]\n", *into_rim = "[[crack]]\nsegment = [[20.0, 22.2], [29.0, 25.1]]\n";
  for (const Shape& shape : {Shape{1, "[2000]", "", jitter, "-0.2 - x", ""},
                             {1, "[2000]", "x < 1700.3", partial, "x - 1700.3", ""},
                             {2, "[31, 38]", hole, jitter, rim, ""},
                             {2, "[31, 47]", hole, partial, rim, ""},
                             {2, "[31, 47]", "", jitter, side, symmetry},
                             {2, "[31, 47]", hole, partial, rim, periodic},
                             {2, "[31, 47]", hole, jitter, rim, crack},
                             {2, "[31, 47]", hole, jitter, rim, into_rim},
                             {3, "[14, 16, 12]", "(x - 7)^2 + (y - 7)^2 + (z + 20)^2 > 22^2", partial,
                              "22 - sqrt((x - 7)^2 + (y - 7)^2 + (z + 20)^2)", ""}}) {
    INFO(shape.dimension, "D, to ", std::string(shape.upper), ", inside ", std::string(shape.inside), ", ",
         std::string(shape.keys), ", surface ", std::string(shape.level), ", ", std::string(shape.beyond));
    const std::string text = scene_text(shape.dimension, lattice(shape.dimension, shape.upper, shape.inside, shape.keys),
                                        "low = \"x < 5.2\"\nsome = \"x > 8\"\nlisted = { points = [90, 3, 250, 17] }",
                                        shape.keys == partial ? cut : "horizon_ratio = 2.015") +
                             held_surface(shape.dimension, shape.level) + shape.beyond;
    compare(text, 2, {3, true});
    compare(text, 3, {2, false, true});
  }
}

TEST_CASE("local bodies: surfaces that cannot be held are refused on all ranks as on one") {
  const std::string sets = "low = \"x < 5\"\nsome = \"y > 9\"\n", side = held_surface(2, "-0.2 - x");
  struct Wrong {
    const char* keys;
    std::string beyond;
  };
  for (const Wrong& wrong : {Wrong{"", side},  // on a lattice
                             {"jitter = 0.2", held_surface(2, "-40 - x")},
                             {"jitter = 0.2", held_surface(2, "5.3 - x")},
                             {"jitter = 0.2", held_surface(2, "x - 35.3 + y")},
                             {"jitter = 0.2", side + side},
                             {"jitter = 0.2", side + "[[symmetry]]\naxis = \"x\"\nat = -0.2\n"},
                             {"jitter = 0.2\ninside = \"x < 4\"", held_surface(2, "(x - 2)^2 - 2.3^2")},
                             {"jitter = 0.2\ninside = \"x < 0\"", side}}) {
    const std::string text = scene_text(2, lattice(2, "[40, 30]", "", wrong.keys), sets) + wrong.beyond;
    INFO(std::string(wrong.keys), ", ", wrong.beyond);
    const std::string expected = message_on(1, [&] {
      const Body body = build_body(parsed(text));
      build_planes(parsed(text), placed_points(body), false);
    });
    CHECK_FALSE(expected.empty());
    for (const int ranks : {2, 3}) CHECK(message_on(ranks, [&] { build_local_body(parsed(text), {}, 7); }) == expected);
  }
}
