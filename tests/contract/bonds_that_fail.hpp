#pragma once
/// What suites of bonds that fail share.

#include <doctest/doctest.h>

#include "tests/contract/fixture.hpp"

namespace perikit::contract {

/// What a criterion says is taken at its word: bonds fail whatever that does to the energy.
inline const char* const limit_of_stretch = "[damage]\ntype = \"critical_stretch\"\nsecond_law = false\nstretch = 0.6\n";

/// Whether forces are -dE/du, so that bonds may fail; scenes with the others are refused.
inline bool bonds_may_fail(const Example& example, int dimension) {
  if (formulation_of(example).force_state == ForceState::variational) return true;
  CHECK_THROWS_WITH_AS(build(scene_text({.dimension = dimension, .conditions = limit_of_stretch}, kinematics_table(example))), doctest::Contains("damage: found with"), InputError);
  return false;
}

}  // namespace perikit::contract
