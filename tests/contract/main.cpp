/// Runs the contract suites.
///   perikit-contract --parts=kinematics/baqp,material/hencky   known parts (default: all), in this process
///   perikit-contract --library=FILE.so                         every part of a library, each in a process of its own
/// --plugin-path=FOLDER (repeatable); whatever else is doctest's. Exit status: 0 kept, 1 broken, 2 refused.

#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string_view>

#include "perikit/plugin/abi.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/contract/library.hpp"

namespace {

using namespace perikit;

/// Of which build of perikit these suites are: `perikit contract` looks for it in the file.
[[gnu::used]] constexpr char build_id[] = PERIKIT_BUILD_ID;

struct Arguments {
  std::string parts;
  std::filesystem::path library;
  std::vector<std::filesystem::path> plugin_path;
};

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int k = 1; k < argc; ++k) {
    const std::string_view word = argv[k];
    const auto value = [&](std::string_view option) { return word.starts_with(option) ? word.substr(option.size()) : std::string_view(); };
    if (const auto parts = value("--parts="); !parts.empty()) arguments.parts = std::string(parts) + ",";
    if (const auto library = value("--library="); !library.empty()) arguments.library = library;
    if (const auto folder = value("--plugin-path="); !folder.empty()) arguments.plugin_path.emplace_back(folder);
  }
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  contract::Subject& subject = contract::subject();
  const Arguments arguments = parse(argc, argv);
  try {
    // First: a library that replaces a known part is the one to test.
    if (!arguments.library.empty()) subject.registry.open(arguments.library);
    subject.third_party = !arguments.library.empty();
    for (const auto& folder : Registry::standard_search_path(arguments.plugin_path)) subject.registry.add_folder(folder);
    // Bodies, laws and steps of the suites are made of the program's own parts.
    if (!subject.registry.known(Kind::kinematics, "conventional") || !subject.registry.known(Kind::material, "saint_venant_kirchhoff")) {
      throw InputError("the contract suites need the parts that come with perikit; they are in none of the folders of plugins");
    }
    if (!arguments.library.empty()) return contract::run_library(arguments.library, argc, argv);
    for (const Kind kind : all_kinds) {
      for (const std::string& part : subject.registry.names(kind)) {
        if (arguments.parts.empty() || arguments.parts.find(fmt::format("{}/{},", name(kind), part)) != std::string::npos) subject.parts.emplace_back(kind, part);
      }
    }
    if (subject.parts.empty()) {
      fmt::print(stderr, "no such part: {}\n", arguments.parts);
      return 2;
    }
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return doctest::Context(argc, argv).run();
}
