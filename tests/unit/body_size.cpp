/// Bodies that cannot be held are refused before anything of their size is allocated.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "setup/body/body.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

std::string refusal(double spacing, double ratio, double jitter, const std::string& inside = "") {
  FakeCatalogue parts;
  const std::string text = SceneText{.dimension = 3, .spacing = spacing, .upper = {1, 1, 1}, .lattice = fmt::format("jitter = {}\n{}", jitter, inside),
                                     .family = fmt::format("horizon_ratio = {}", ratio), .integrator = "newton"};
  const Scene scene = parse_scene(text, "plate.toml", parts);
  return message_of<InputError>([&] { build_body(scene); });
}

}  // namespace

TEST_CASE("bodies: more than memory holds is refused with the numbers, before it is allocated") {
  CHECK(refusal(1.0 / 1200, 10, 0.1).find("points with a horizon of 10 spacings, which need") != std::string::npos);
  CHECK(refusal(1.0 / 200, 60, 0.1).find("GB or more; allowed: the ") != std::string::npos);
  CHECK(refusal(1.0 / 100, 40, 0).find("allowed: at most 65535 on a lattice") != std::string::npos);
  CHECK(refusal(1.0 / 100, 40, 0).find("plate.toml:2:1: family:") == 0);
  // What counts is what `inside` leaves.
  CHECK(refusal(1.0 / 100, 60, 0.1, "inside = \"x + y + z < 0.06\"").empty());
}
