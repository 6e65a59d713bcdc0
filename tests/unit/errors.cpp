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
