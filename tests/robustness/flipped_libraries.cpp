/// Libraries of parts with one other bit. With their manifests: refused, so that no part whose bytes are others computes anything. Without:
/// tried in a process of its own, whose end is not that of perikit.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

struct Outcomes {
  std::map<std::string, int> with_manifest, alone;
};

/// The first words of why the library was refused, numbers left out.
std::string reason(const std::string& text) {
  for (const std::string before : {"flipped.so: this library is refused: ", "flipped.so ("}) {
    const std::size_t at = text.find(before);
    if (at == std::string::npos) continue;
    std::string words = text.substr(at + before.size(), 48);
    std::ranges::replace_if(words, [](char c) { return c >= '0' && c <= '9'; }, '#');
    return words.substr(0, words.find_first_of(":\n'"));
  }
  return "taken";
}

/// The name of the part that a manifest names first.
std::string part_of(const std::string& manifest) {
  const auto value = [&](const std::string& key) {
    const std::size_t at = manifest.find("\n" + key + " = '") + key.size() + 5;
    return manifest.substr(at, manifest.find('\'', at) - at);
  };
  return value("kind") + "/" + value("name");
}

/// alone: without their manifests, too.
Outcomes flip(int count, unsigned seed, bool alone) {
  std::mt19937 random(seed);
  std::vector<fs::path> libraries;
  for (const auto& entry : fs::directory_iterator(PERIKIT_PARTS))
    if (entry.path().extension() == ".so") libraries.push_back(entry.path());
  std::ranges::sort(libraries);
  REQUIRE(libraries.size() > 20);
  const Desk desk;
  fs::create_directory(desk.path("parts"));
  Outcomes outcomes;
  for (int k = 0; k < count; ++k) {
    const fs::path& library = libraries[random() % libraries.size()];
    const std::string manifest = read(fs::path(library).replace_extension(".parts")), part = part_of(manifest);
    std::string bytes = read(library);
    // Every third flip where the loader reads: headers, symbols and relocations stand first.
    const std::size_t at = random() % (k % 3 == 0 ? std::min<std::size_t>(bytes.size(), 8192) : bytes.size());
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    INFO("flip ", k, " of seed ", seed, ": ", library.filename().string(), " at ", at);
    desk.write("parts/flipped.so", bytes);
    desk.write("parts/flipped.parts", manifest);
    const Result told = desk.perikit("describe " + part + " --plugin-path parts");
    // Where its headers alone show it, the scan passes it over, and the part is that of the standard library.
    const std::string why = told.status == 0 ? desk.perikit("describe material/none --plugin-path parts").err : told.err;
    CHECK((told.status == 0 || told.status == 2));
    CHECK_MESSAGE(reason(why) != "taken", why);
    ++outcomes.with_manifest[reason(why)];
    if (!alone) continue;
    // Without a manifest nothing says what the bytes should be: the library is tried, and opened where its part is wanted.
    fs::remove(desk.path("parts/flipped.parts"));
    const Result wanted = desk.perikit("describe " + part + " --plugin-path parts");
    CHECK_MESSAGE((wanted.status == 0 || wanted.status == 2 || (wanted.status == 1 && contains(wanted.err, "flipped.so"))), wanted.err);
    const Result asked = desk.perikit("describe material/none --plugin-path parts");
    CHECK(asked.status == 2);
    CHECK_MESSAGE(contains(asked.err, "neo_hookean"), asked.err);   // the parts of others are there
    ++outcomes.alone[reason(asked.err)];
  }
  return outcomes;
}

std::string words(const std::map<std::string, int>& outcomes) {
  std::string text;
  for (const auto& [what, count] : outcomes) text += fmt::format("\n  {} {}", count, what);
  return text;
}

}  // namespace

TEST_CASE("flipped libraries: one other bit is refused") {
  const auto seed = std::random_device{}();
  const Outcomes outcomes = flip(12, seed, false);
  CHECK(!outcomes.with_manifest.contains("taken"));
}

TEST_CASE("flipped libraries: a library that was built anew with the same size gets its manifest") {
  const Desk desk;
  fs::create_directory(desk.path("parts"));
  std::string bytes = read(fs::path(PERIKIT_PARTS) / "influence_cone.so");
  bytes.back() = static_cast<char>(bytes.back() ^ 1);   // the end of the section table, which the loader does not read
  desk.write("parts/cone.so", bytes);
  desk.write("parts/cone.parts", read(fs::path(PERIKIT_PARTS) / "influence_cone.parts"));
  const std::string describe = "describe influence/cone --plugin-path parts";
  CHECK(desk.perikit(describe).status == 2);
  REQUIRE(std::system(fmt::format("'{}-manifest' '{}'", PERIKIT_PROGRAM, desk.path("parts/cone.so").string()).c_str()) == 0);
  const Result known = desk.perikit(describe);
  CHECK_MESSAGE(known.status == 0, known.err);
}

// ninja many_flips: ten minutes.
TEST_CASE("flipped libraries: many" * doctest::skip()) {
  const char* asked = std::getenv("PERIKIT_FLIPS");
  const auto seed = std::random_device{}();
  const int count = asked ? std::atoi(asked) : 1000;
  REQUIRE(count > 0);
  const Outcomes outcomes = flip(count, seed, true);
  MESSAGE(count, " flips of seed ", seed, "; with their manifest:", words(outcomes.with_manifest), "\nwithout:", words(outcomes.alone));
  CHECK(!outcomes.with_manifest.contains("taken"));
}
