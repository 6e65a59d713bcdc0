/// The small version of the stability suite (ninja stability): one lattice or cloud in each dimension for every kinematics.

#include <doctest/doctest.h>

#include "tests/stability/measures.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::stability;
using perikit::validation::registry;

namespace {

/// constant on a line and on a jittered cube, gaussian on a jittered square.
std::vector<Setting> small_settings() {
  std::vector<Setting> some;
  for (const Setting& s : all_settings(registry())) {
    if (s.dimension == 1 && s.influence == "constant" && s.horizon_ratio == 2.015 && s.jitter == 0.0) some.push_back(s);
    if (s.dimension == 2 && s.influence == "gaussian" && s.horizon_ratio == 3.015 && s.jitter == 0.2) some.push_back(s);
    if (s.dimension == 3 && s.influence == "constant" && s.horizon_ratio == 3.015 && s.jitter == 0.1) some.push_back(s);
  }
  return some;
}

}  // namespace

TEST_CASE(
    "stability: no negative eigenvalue, none near zero but in the conventional model, and gradients that are exact for affine "
    "fields") {
  for (const Setting& setting : small_settings()) {
    INFO(setting.label, " ", setting.dimension, "D");
    Specimen specimen(registry(), setting);
    const Spectrum spectrum = specimen.spectrum();
    CHECK(spectrum.lowest >= -1e-13);
    CHECK(spectrum.poor_points == 0);
    if (setting.label == "conventional") {
      CHECK(spectrum.lowest_rough < 5e-3);
    } else {
      CHECK(spectrum.lowest_rough > 0.02);
    }
    const Accuracy accuracy = specimen.accuracy();
    if (accuracy.affine < 0) continue;  // a pair law
    CHECK(accuracy.affine <= 1e-12);
    CHECK(accuracy.quadratic_surface > 0.1);
    CHECK(accuracy.quadratic_surface <= 4);
  }
}

TEST_CASE("stability: needles among the parts of a cloud do not set the stable step") {
  for (const Setting& setting : small_settings()) {
    if (setting.label != "sub_horizon" || setting.jitter == 0) continue;
    Setting lattice = setting;
    lattice.jitter = 0;
    // The step goes with 1/sqrt(largest): a fifth of the lattice's and less with parts whose eigenvalues spread by up to a factor
    // of 1000.
    CHECK(Specimen(registry(), setting).spectrum().largest <= 4 * Specimen(registry(), lattice).spectrum().largest);
  }
}

TEST_CASE("stability: penalties over families that are almost flat do not turn negative") {
  for (Setting s : all_settings(registry())) {
    if (s.kinematics.find("stabilization") == std::string::npos || s.influence != "cubic_spline" || s.horizon_ratio != 1.015 ||
        s.dimension != 2)
      continue;
    // Of clouds a horizon of one spacing would leave pieces of two points, which are refused.
    if (s.jitter > 0) s.horizon_ratio = 1.3;
    INFO(s.label, " jitter ", s.jitter);
    CHECK(Specimen(registry(), s).spectrum().lowest >= -1e-13);
  }
}

TEST_CASE("stability: the estimated step is the true one to 2 %; at 0.99 of it runs are bounded, at 1.05 they are not") {
  for (const Setting& setting : small_settings()) {
    INFO(setting.label, " ", setting.dimension, "D");
    Specimen specimen(registry(), setting);
    const Spectrum spectrum = specimen.spectrum();
    CHECK(spectrum.estimate >= 0.96);
    CHECK(spectrum.estimate <= 1.04);
    CHECK(specimen.growth(spectrum.largest, 0.99, 100) <= 2.0);
    CHECK(specimen.growth(spectrum.largest, 0.9, 500) <= 2.0);
    CHECK(specimen.growth(spectrum.largest, 1.05, 100) >= 1e6);
  }
}

TEST_CASE("stability: the energy of a random perturbation does not drift") {
  // perikit_stability --endurance: 100 000 steps of every kinematics.
  for (const Setting& setting : long_settings(registry())) {
    if (setting.dimension == 3 || (setting.label != "baqp" && setting.label != "sub_horizon" && setting.label != "conventional"))
      continue;
    INFO(setting.label, " ", setting.dimension, "D, jitter ", setting.jitter);
    Specimen specimen(registry(), setting);
    const Drift energy = specimen.endure(specimen.spectrum().largest, 0.9, 5000);
    CHECK(energy.largest_deviation <= 2);
    CHECK(std::abs(energy.drift) <= 0.02);
  }
}

TEST_CASE("stability: a bar vibrates on with bounded energy") {
  // ninja vibration: a million steps.
  for (const std::string kinematics : {"baqp", "conventional", "bond_associated", "ordinary"}) {
    INFO(kinematics);
    const Vibration vibration = vibrate(registry(), kinematics, 20000);
    CHECK(vibration.largest_deviation <= 0.05);
    CHECK(std::abs(vibration.drift) <= 1e-4);
  }
}
