/// Runs the contract suites: perikit_contract --parts=kinematics/baqp,material/hencky (default: all known parts).

#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>

#include "tests/contract/fixture.hpp"

int main(int argc, char** argv) {
  using namespace perikit;
  contract::Subject& subject = contract::subject();
  try {
    for (const auto& folder : Registry::standard_search_path({PERIKIT_PLUGIN_FOLDER})) subject.registry.add_folder(folder);
    std::string wanted;
    for (int k = 1; k < argc; ++k) {
      if (std::strncmp(argv[k], "--parts=", 8) == 0) wanted = std::string(argv[k] + 8) + ",";
    }
    for (const Kind kind : all_kinds) {
      for (const std::string& part : subject.registry.names(kind)) {
        if (wanted.empty() || wanted.find(fmt::format("{}/{},", name(kind), part)) != std::string::npos) subject.parts.emplace_back(kind, part);
      }
    }
    if (subject.parts.empty()) {
      fmt::print(stderr, "no such part: {}\n", wanted);
      return 2;
    }
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return doctest::Context(argc, argv).run();
}
