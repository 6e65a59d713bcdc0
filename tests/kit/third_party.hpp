#pragma once
/// The parts of this build and those that the tests write as third parties do (tests/contract/third_party.cpp).

#include <string>

#include "plugin/registry.hpp"

namespace perikit::test {

inline Registry& with_third_parties() {
  static Registry registry;
  [[maybe_unused]] static const bool filled =
      (registry.add_folder(PERIKIT_PLUGIN_FOLDER), registry.open(std::string(PERIKIT_TEST_PLUGIN_FOLDER) + "/third_party/third_party.so"), true);
  return registry;
}

}  // namespace perikit::test
