/// Kinds of warnings: their names, and the page that lists them.

#include <doctest/doctest.h>

#include <fstream>
#include <iterator>

#include "perikit/core/warnings.hpp"

using namespace perikit;

TEST_CASE("warnings: a name is what stands in brackets at the end") {
  CHECK(named("box", "warning: the box of [body.lattice] is too large") == "warning: the box of [body.lattice] is too large [box]");
  CHECK(warning_name("warning: the box of [body.lattice] is too large [box]") == "box");
  CHECK(warning_name("warning: of [body.lattice]").empty());
  CHECK(warning_name("warning: of [box] of points").empty());
  CHECK(warning_name("").empty());
  const std::vector<std::string> silence = {"thin", "box"};
  CHECK(without_silenced({"a [box]", "b", "c [set]"}, silence) == std::vector<std::string>{"b", "c [set]"});
}

TEST_CASE("warnings: every kind is on the page of refusals, once") {
  std::ifstream file(PERIKIT_SOURCE_FOLDER "/framework/docs/refusals.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  CHECK(std::ranges::is_sorted(warning_kinds));
  for (const std::string_view kind : warning_kinds) {
    const std::string row = "\n| `" + std::string(kind) + "` |";
    CHECK_MESSAGE(page.find(row) != std::string::npos, kind);
    CHECK(page.find(row) == page.rfind(row));
  }
}
