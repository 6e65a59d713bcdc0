/// Parts of bodies with held faces of single points: what lies beyond them is that of the whole body.

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
