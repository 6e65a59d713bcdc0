/// Bonds that are not looked at because they cannot have failed yet: they fail at the steps at which they would fail otherwise.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

/// Stretched slowly and evenly, at the rate 0.002/s: every group of points uses up its margin, and no more than that, before its bonds fail.
std::string stretched(const std::string& kinematics, const std::string& more) {
  std::string scene = replaced(replaced(plate, "upper = [8, 5]\n", "upper = [24, 12]\n" + more), "right = \"x > 6\"", "right = \"x > 22\"");
  scene = replaced(replaced(scene, "type = \"baqp\"", "type = \"" + kinematics + "\""), "velocity = [0.1, \"free\"]", "velocity = [0.048, \"free\"]");
  scene = replaced(scene, "time_step = 0.02\nend_time = 1.0", "end_time = 30.0");
  return replaced(scene, "[output]\nframes = 5",
                  "[initial]\nvelocity = [\"0.002*x\", 0]\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.02\n[output]\nframes = 5");
}

}  // namespace

TEST_CASE("skipped checks: margins are used up in time, on lattices and clouds") {
  for (const auto& [kinematics, more] : {std::pair<std::string, std::string>{"bond_based", ""}, {"baqp", ""}, {"bond_based", "jitter = 0.05\n"}}) {
    INFO(kinematics, " ", more);
    const Desk desk(stretched(kinematics, more));
    for (const std::string skip : {"true", "false"}) {
      const Result run = desk.perikit(fmt::format("run scene.toml --quiet -o {0} --set run.skip={0}", skip));
      REQUIRE_MESSAGE(run.status == 0, run.err);
    }
    const bool same = desk.text("true/history.csv") == desk.text("false/history.csv");
    CHECK_MESSAGE(same, "bonds fail at other steps");
    const std::string log = desk.text("true/run.log");
    const std::size_t at = log.find("bond checks ");
    REQUIRE(at != std::string::npos);
    const std::string share = log.substr(log.find('(', at) + 1, 12);
    CHECK_MESSAGE(std::stod(share) < 95, log.substr(at, 100));  // else nothing was skipped
    CHECK(!contains(log, "failed bonds  0,"));
  }
}

TEST_CASE("skipped checks: bonds between onset and failure are looked at in every step, on lattices and clouds") {
  for (const auto& [kinematics, more] : {std::pair<std::string, std::string>{"bond_based", ""}, {"baqp", ""}, {"bond_based", "jitter = 0.05\n"}, {"baqp", "jitter = 0.05\n"}}) {
    INFO(kinematics, " ", more);
    const Desk desk(replaced(stretched(kinematics, more), "type = \"critical_stretch\"\nstretch = 0.02", "type = \"smooth_degradation\"\nstretch_min = 0.02\nstretch = 0.5"));
    for (const std::string& run : {std::string("true --set run.skip=true"), std::string("false --set run.skip=false"), std::string("whole --set damage.stretch_min=0.4")}) {
      const Result told = desk.perikit("run scene.toml --quiet -o " + run);
      REQUIRE_MESSAGE(told.status == 0, told.err);
    }
    const bool same = desk.text("true/history.csv") == desk.text("false/history.csv");
    CHECK_MESSAGE(same, "bonds weaken at other steps");
    const bool weakened = desk.text("true/history.csv") != desk.text("whole/history.csv");
    CHECK_MESSAGE(weakened, "no bond weakens");
  }
}
