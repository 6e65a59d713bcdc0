#include <doctest/doctest.h>

#include <vector>

#include "perikit/core/errors.hpp"

using namespace perikit;

TEST_CASE("an input error names file, line, column and key") {
  const InputError error({"bar.toml", 7, 3}, "horizon", "found -1; must be > 0");
  CHECK(std::string(error.what()) == "bar.toml:7:3: horizon: found -1; must be > 0");
}

TEST_CASE("the nearest name is a likely slip, or nothing") {
  const std::vector<std::string> names{"neo_hookean", "saint_venant_kirchhoff", "hencky"};
  CHECK(nearest("neo_hokean", names) == "neo_hookean");
  CHECK(nearest("henkcy", names) == "hencky");
  CHECK(nearest("steel", names).empty());
  CHECK(did_you_mean("hency", names) == "; did you mean 'hencky'?");
}

TEST_CASE("errors: words of other programs are answered with what there is") {
  const std::vector<std::string> known = {"body", "load"};
  CHECK(did_you_mean("gravity", known) == "; gravity is a load: [[load]] set = \"all\", body_force = [...] per volume");
  for (const char* word : {"elastic_plastic", "temperature", "mesh", "table"}) CHECK(!did_you_mean(word, known).empty());
  CHECK(did_you_mean("lod", known) == "; did you mean 'load'?");
  CHECK(did_you_mean("interstellar", known).empty());
}
