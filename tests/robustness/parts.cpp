/// Libraries of parts that throw, hang or are not what their manifests say: each is named, and the rest goes on.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <chrono>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

/// A folder `parts` on the desk with one of the libraries that lie.
void bring(const Desk& desk, const std::string& name) {
  fs::create_directories(desk.path("parts"));
  fs::copy_file(fs::path(PERIKIT_LIES) / (name + ".so"), desk.path("parts/" + name + ".so"),
                fs::copy_options::overwrite_existing);
}

}  // namespace

TEST_CASE("parts: what a part throws is told with the library or part that threw it") {
  const Desk desk(replaced(plate, "bulk_modulus = 2.0", "lame_lambda = 1.0"));
  bring(desk, "thrower");
  const Result thrown = desk.perikit(
      "run scene.toml --quiet -o out --plugin-path parts --set material.type=thrower --set integrator.time_step=1e-3");
  CHECK(thrown.status == 1);
  CHECK_MESSAGE(contains(thrown.err, "parts/thrower.so threw where nothing may be thrown: something that is no std::exception"),
                thrown.err);
  bring(desk, "thrown_run");
  const Result run = desk.perikit("run scene.toml --quiet -o out --plugin-path parts --set integrator.type=thrown_run");
  CHECK(run.status == 1);
  CHECK_MESSAGE(
      contains(run.err,
               "the run failed: integrator thrown_run: it threw something that is no std::exception; last good frame: none"),
      run.err);
}

TEST_CASE("parts: a registration that stops or never ends is refused, and every command goes on") {
  const Desk desk;
  bring(desk, "stopped");
  bring(desk, "endless");
  const auto start = std::chrono::steady_clock::now();
  const Result list = desk.perikit("list material --plugin-path parts");
  CHECK(list.status == 0);
  CHECK(contains(list.out, "neo_hookean"));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(60));
  const Result asked = desk.perikit("describe material/endles --plugin-path parts");
  CHECK(asked.status == 2);
  for (const std::string name : {"stopped", "endless"})
    CHECK_MESSAGE(contains(asked.err, name + ".so (its registration does not come to an end"), asked.err);
}

TEST_CASE("parts: a crash is laid at the door of the libraries that nothing vouches for, and they are opened only where they are wanted") {
  const Desk desk;
  bring(desk, "crasher");
  const Result wanted = desk.perikit("run scene.toml --quiet -o out --plugin-path parts --set family.influence=crasher");
  CHECK(wanted.status == 1);
  CHECK_MESSAGE(contains(wanted.err, "crashed after it had opened libraries that have no manifest"), wanted.err);
  CHECK_MESSAGE(contains(wanted.err, "parts/crasher.so"), wanted.err);
  const Result list = desk.perikit("list influence --plugin-path parts");
  CHECK(list.status == 0);
  CHECK_MESSAGE(contains(list.out, "crasher"), list.out);
}

TEST_CASE("parts: a manifest that lies costs its own parts alone") {
  const Desk desk;
  bring(desk, "company");
  const std::string size = fmt::format("{}", fs::file_size(desk.path("parts/company.so")));
  // What the program itself would write, but for the parts that it names.
  fs::path standard;
  for (const auto& entry : fs::directory_iterator(PERIKIT_PARTS))
    if (entry.path().extension() == ".parts") standard = entry.path();
  REQUIRE(!standard.empty());
  std::string manifest;
  for (const std::string& line : lines(read(standard))) {
    if (line.starts_with("part") || line.starts_with("[[part")) break;
    if (line.starts_with("size"))
      manifest += "size = " + size + "\n";
    else if (line.starts_with("abi") || line.starts_with("build_id") || line.starts_with("format") ||
             line.starts_with("checksum"))
      manifest += line + "\n";
  }
  desk.write("parts/company.parts", manifest + "[[part]]\nkind = \"influence\"\nname = \"imagined\"\nsummary = \"not there\"\n");
  const Result list = desk.perikit("list --plugin-path parts influence");
  CHECK_MESSAGE(list.status == 0, list.err);
  CHECK_MESSAGE(contains(list.out, "gaussian"), list.out);
  INFO(list.out);
  CHECK((contains(list.out, "cannot be opened: ") || contains(list.out, "company")));
}

TEST_CASE("parts: small things of the command line") {
  const Desk desk;
  // --plugin-path takes one folder.
  fs::create_directories(desk.path("parts"));
  const Result list = desk.perikit("list --plugin-path parts material");
  CHECK_MESSAGE(list.status == 0, list.err);
  CHECK(contains(list.out, "neo_hookean"));
  CHECK(!contains(list.out, "gaussian"));
  // A scene that is refused is not printed.
  const Result refused = desk.perikit("check scene.toml --set integrator.time_step=100");
  CHECK(refused.status == 2);
  CHECK(refused.out.empty());
  // A name that is none.
  desk.write("empty.toml", "plugins = [\"\"]\n" + plate);
  for (const std::string trust : {"", " --trust"}) {
    const Result empty = desk.perikit("check empty.toml" + trust);
    CHECK(empty.status == 2);
    CHECK_MESSAGE(contains(empty.err, "empty.toml:1:"), empty.err);
    CHECK_MESSAGE(!contains(empty.err, "internal error"), empty.err);
  }
  // A study of many combinations says what it does.
  std::string numbers;
  for (int k = 1; k <= 40; ++k) numbers += fmt::format("{}.0, ", k);
  desk.write("study.toml",
             fmt::format("format = 1\nscene = \"scene.toml\"\n[values]\nmaterial.density = [{0}]\nmaterial.shear_modulus = "
                         "[{0}]\n[[quantity]]\nname = \"nothing\"\nfrom = \"no_column\"\n",
                         numbers));
  const Result study = desk.perikit("study study.toml -o study");
  CHECK(study.status == 2);
  CHECK_MESSAGE(contains(study.out, "1600 combinations; reading their scenes\n"), study.out);
}
