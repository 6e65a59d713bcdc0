/// Standard streams that are closed or full, texts that are too deep, conditions without a value, and memory that does not
/// suffice.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

/// The exit status of the program with these arguments and redirections; 128 + n: killed by signal n.
int status_of(const Desk& desk, const std::string& arguments, const std::string& redirected, const std::string& before = {}) {
  const std::string command = fmt::format("cd '{}' && {} timeout -s KILL 60 '{}' {} {}", desk.path(".").string(), before,
                                          PERIKIT_PROGRAM, arguments, redirected);
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  return WEXITSTATUS(status);
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int k = 0; k < times; ++k) all += text;
  return all;
}

}  // namespace

TEST_CASE("streams: results are the same with standard streams closed") {
  const Desk desk;
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  for (const std::string closed : {"2>&-", ">&-", "<&- >&- 2>&-"}) {
    INFO(closed);
    CHECK(status_of(desk, "run scene.toml -o out", closed) == 0);
    CHECK(desk.text("out/history.csv") == desk.text("whole/history.csv"));
    CHECK(desk.text("out/scene.toml") == desk.text("whole/scene.toml"));
  }
}

TEST_CASE("streams: what cannot be printed is a status, never a crash") {
  const Desk desk;
  const std::string everything = "> /dev/full 2> /dev/full";
  CHECK(status_of(desk, "run scene.toml -o out", "> /dev/null 2> /dev/full") == 0);  // progress alone
  CHECK(status_of(desk, "run scene.toml -o out", "2> /dev/null > /dev/full") == 1);
  CHECK(status_of(desk, "run scene.toml -o out", everything) == 1);
  CHECK(fs::exists(desk.path("out/frames/00000005.h5")));
  CHECK(status_of(desk, "run scene.toml --quiet -o out", everything) == 0);  // nothing to say
  for (const std::string command : {"check scene.toml", "list", "describe scene", "--help", "--version"}) {
    INFO(command);
    CHECK(status_of(desk, command, "2> message.txt > /dev/full") == 1);
    CHECK(contains(desk.text("message.txt"), "standard output cannot be written"));
    CHECK(status_of(desk, command, everything) == 1);
  }
  for (const std::string refused : {"run nowhere.toml", "walk", "", "check scene.toml --set a=b"})
    CHECK_MESSAGE(status_of(desk, refused, everything) == 2, refused);
}

TEST_CASE("streams: TOML that is too deep or too large is refused before it is read") {
  const int many = 60000;
  for (const std::string& text : {repeated("a.", many) + "a = 1\n", "[" + repeated("a.", many) + "a]\n",
                                  "a = " + repeated("[", many) + repeated("]", many) + "\n",
                                  "a = " + repeated("{a=", many) + "1" + repeated("}", many) + "\n",
                                  "a = " + repeated("[{a.a=", many), repeated("\"a.b\".", many) + "a = 1\n"}) {
    const Desk desk(plate + text);
    desk.write("study.toml", text);
    INFO(text.substr(0, 20));
    for (const std::string command : {"check scene.toml", "run scene.toml -o out", "study study.toml"}) {
      const Result result = desk.perikit(command);
      CHECK(result.status == 2);
      CHECK_MESSAGE(contains(result.err, "allowed: at most 32"), result.err.substr(0, 300));
    }
    // A manifest beside a library: the library is refused, and nothing else.
    fs::create_directories(desk.path("parts"));
    desk.write("parts/mine.so", "no library");
    desk.write("parts/mine.parts", text);
    CHECK(desk.perikit("list --plugin-path parts material").status == 0);
  }
  const Desk desk;
  CHECK(desk.perikit("check scene.toml --set " + repeated("a.", many / 4) + "a=1").status == 2);
  // Dots in texts and numbers, and brackets side by side, are not deep.
  desk.write("flat.toml", replaced(plate, "Pulled plate", repeated("a.b [[{", 100)) + "# " + repeated("[a.", 100) +
                              "\n[constants]\n\"a\" = 1.5 # " + repeated("'", 3) + "\n");
  CHECK_MESSAGE(desk.perikit("check flat.toml").status == 0, desk.perikit("check flat.toml").err);
  desk.write("large.toml", plate);
  fs::resize_file(desk.path("large.toml"), std::uintmax_t{1} << 34);
  const Result large = desk.perikit("check large.toml", "ulimit -v 1000000;");
  CHECK(large.status == 2);
  CHECK_MESSAGE(contains(large.err, "large.toml: has 17179869184 bytes"), large.err);
}

TEST_CASE("streams: check refuses what run refuses") {
  const Desk desk;
  for (const std::string set :
       {"'load=[{set=\"right\",force=[\"1/(x-x)\",0]}]'", "'load=[{set=\"right\",body_force=[\"log(x-100)\",0]}]'",
        "'load=[{set=\"right\",force=[\"1/t\",0]}]'", "'load=[{set=\"right\",force=[\"sqrt(0.5-t)\",0]}]'",
        "'boundary=[{set=\"left\",velocity=[\"1/t\",0]}]'", "'boundary=[{set=\"left\",displacement=[\"t/(x-x)\",0]}]'",
        "'output.history=[{name=\"e\",set=\"right\",quantity=\"displacement\",component=\"x\",reduce=\"error\",exact=\"1/"
        "t\"}]'"}) {
    INFO(set);
    const Result checked = desk.perikit("check scene.toml --set " + set),
                 run = desk.perikit("run scene.toml --quiet -o out --set " + set);
    CHECK_MESSAGE(checked.status == 2, checked.err);
    CHECK_MESSAGE(run.status == 2, run.err);
    CHECK_MESSAGE(!fs::exists(desk.path("out")), "a refused scene leaves a folder");
  }
}

TEST_CASE("streams: newton without memory ends, and says why" * doctest::skip(unlimited_addresses)) {
  const Desk desk(replaced(replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [0.1, \"free\"]"),
                           "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0", "type = \"newton\""));
  for (const int kilobytes : {100000, 150000, 200000, 250000, 300000, 400000}) {
    const int status = status_of(desk, "run scene.toml -o out --force", "> /dev/null 2> message.txt",
                                 fmt::format("ulimit -v {}; ulimit -c 0;", kilobytes));
    MESSAGE(kilobytes, " kB: status ", status, " ", desk.text("message.txt"));
    CHECK((status == 0 || status == 1));
    if (status != 0) CHECK(!desk.text("message.txt").empty());
  }
}
