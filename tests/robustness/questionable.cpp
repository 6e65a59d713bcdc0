/// Scenes that say what can hardly be meant: each a warning that names the key, or an error.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

void warned(const std::string& scene, const std::string& options, const std::string& words) {
  const Desk desk(scene);
  const Result checked = desk.perikit("check scene.toml " + options);
  CHECK_MESSAGE(checked.status == 0, checked.err);
  CHECK_MESSAGE(contains(checked.out, "# warning       " + words), "no '", words, "' in\n", checked.out, checked.err);
}

void refused(const std::string& scene, const std::string& options, const std::string& words) {
  const Desk desk(scene);
  const Result checked = desk.perikit("check scene.toml " + options);
  CHECK(checked.status == 2);
  CHECK_MESSAGE(contains(checked.err, words), "no '", words, "' in\n", checked.err);
}

void silent(const std::string& scene, const std::string& options = {}) {
  const Result checked = Desk(scene).perikit("check scene.toml " + options);
  CHECK_MESSAGE(checked.status == 0, checked.err);
  CHECK_MESSAGE(!contains(checked.out, "# warning"), checked.out);
}

}  // namespace

TEST_CASE("questionable: cracks that cut nothing") {
  silent(plate);
  silent(plate + "[[crack]]\nsegment = [[4, -1], [4, 2]]\n");
  for (const std::string segment : {"[[20, 0], [20, 5]]", "[[1e300, 0], [1e300, 1e300]]", "[[4, 6], [4, 8]]"})
    warned(plate + "[[crack]]\nsegment = [[4, -1], [4, 2]]\n[[crack]]\nsegment = " + segment + "\n", "",
           "crack.1 (line 46) cuts no bond of the body");
}

TEST_CASE("questionable: boundaries that contradict each other") {
  const std::string second = "\n[[boundary]]\nset = \"corner\"\n", sets = "left = \"x < 2\"\ncorner = \"x < 1 && y < 1\"";
  const std::string scene = replaced(plate, "left = \"x < 2\"", sets);
  const auto with = [&](const std::string& motion) {
    return replaced(scene, "\n[integrator]", second + motion + "\n[integrator]");
  };
  for (const std::string same :
       {"displacement = [0, 0]", "displacement = [\"0*x\", \"free\"]", "velocity = [0, 0]", "displacement = [\"free\", \"0*t\"]"})
    silent(with(same));
  for (const std::string other : {"displacement = [0, 1]", "displacement = [\"free\", \"t\"]", "velocity = [\"free\", 1]",
                                  "displacement = [\"free\", \"t*(1-t)*(t-0.3)\"]"}) {
    INFO(other);
    refused(with(other), "", "boundary.2: found a ");
    refused(with(other), "",
            "for the point at (0.5, 0.5, 0), which boundary.0 (line 31) gives a displacement of 0; allowed: the "
            "same motion");
  }
}

TEST_CASE("questionable: loads on held points, and starts that boundaries contradict") {
  const auto load = [](const std::string& text) { return plate + "[[load]]\n" + text; };
  warned(load("set = \"left\"\nforce = [1, 0]\n"), "", "load.0 (line 44) acts in x on 10 of 10 points that are held in x");
  warned(load("set = \"all\"\nforce = [0, 1]\n"), "", "load.0 (line 44) acts in y on 10 of 40 points that are held in y");
  silent(load("set = \"all\"\nbody_force = [0, 1]\n"));
  silent(load("set = \"right\"\nforce = [0, 1]\n"));
  warned(load("set = \"left\"\nbody_force = [0, 1]\n"), "", "load.0 (line 44) acts in y on 10 of 10");
  warned(
      plate + "[initial]\ndisplacement = [0.1, 0]\n", "",
      "boundary.0 (line 30) gives the point at (0.5, 0.5, 0) a displacement of 0 in x at t = 0, where the body starts with 0.1");
  warned(plate + "[initial]\nvelocity = [0, 0]\n", "",
         "boundary.1 (line 33) gives the point at (6.5, 0.5, 0) a velocity of 0.1 in x at t = 0, where the body starts with 0");
  warned(replaced(plate, "displacement = [0, 0]", "displacement = [0, 0.01]"), "",
         "boundary.0 (line 30) gives the point at (0.5, 0.5, 0) a displacement of 0.01 in y");
  silent(plate + "[initial]\nvelocity = [\"0.1*(x > 6)\", 0]\n");
}

TEST_CASE("questionable: influence functions that leave nothing of a family") {
  const Desk desk;   // with a library whose influence is negative
  fs::create_directories(desk.path("parts"));
  fs::copy_file(fs::path(PERIKIT_LIES) / "negative.so", desk.path("parts/negative.so"));
  const Result negative = desk.perikit("check scene.toml --plugin-path parts --set family.influence=negative");
  CHECK(negative.status == 2);
  CHECK_MESSAGE(contains(negative.err, "found \"negative\", which is positive at no distance up to the horizon"), negative.err);
  warned(plate, "--set family.horizon_ratio=1.015 --set family.influence=cubic_spline", "influence \"cubic_spline\" is ");
  silent(plate, "--set family.influence=cubic_spline");
  silent(plate, "--set family.horizon_ratio=1.015 --set family.influence=constant");
}

TEST_CASE("questionable: moduli that rounding decides, or that overflow") {
  const auto set = [](const std::string& constants) {
    return "--set 'material={type=\"linear_elastic\",density=1," + constants + "}'";
  };
  for (const std::string constants :
       {"youngs_modulus=1,poisson_ratio=0.49999999999999994", "youngs_modulus=1,poisson_ratio=0.4999999999999",
        "shear_modulus=1,poisson_ratio=0.49999999999999994"})
    refused(plate, set(constants), "material.poisson_ratio: found poisson_ratio = ");
  refused(plate, set("youngs_modulus=2.9999999999999996,shear_modulus=1"), "rounding decides the bulk modulus");
  for (const std::string constants : {"youngs_modulus=1e300,poisson_ratio=0.3", "shear_modulus=1,bulk_modulus=1e300",
                                      "youngs_modulus=1e-300,poisson_ratio=0.3"})
    refused(plate, set(constants), "a value between 1e-100 and 1e+100");
  CHECK(Desk()
            .perikit("check scene.toml --set integrator.time_step=1e-8 " + set("youngs_modulus=1,poisson_ratio=0.499999"))
            .status == 0);
}

TEST_CASE("questionable: a field that is not finite is told of") {
  const Desk desk(replaced(replaced(plate, "frames = 5", "frames = 5\nfields = [\"displacement\", \"shape_tensor_condition\"]"),
                           "upper = [8, 5]\n", "upper = [12, 5]\ninside = \"x < 8 || (x > 11 && y < 1)\"\n"));
  const Result run = desk.perikit("run scene.toml -o out");
  CHECK_MESSAGE(run.status == 0, run.err);
  CHECK_MESSAGE(
      contains(run.out,
               "warning: frame 0: shape_tensor_condition is not finite at point 8 (in input order), whose family is too poor"),
      run.out);
}

TEST_CASE("questionable: faces of a crack that pass through each other are told of, once") {
  const std::string crack = "[[crack]]\nsegment = [[4, -1], [4, 6]]\n";
  const auto run = [](const std::string& scene, const std::string& options = {}) {
    const Result result = Desk(scene).perikit("run scene.toml -o out " + options);
    CHECK_MESSAGE(result.status == 0, result.err);
    return result.out;
  };
  const std::string pressed =
      run(replaced(plate, "velocity = [0.1", "velocity = [-0.5") + crack + "[initial]\nvelocity = [\"x > 4 ? -0.5 : 0\", 0]\n");
  const std::string words = "faces of cracks pass through each other at ";
  const std::size_t first = pressed.find("warning: time 0.2: " + words);
  CHECK_MESSAGE(first != std::string::npos, pressed);
  CHECK(contains(pressed, "warnings      1"));
  CHECK(!contains(run(plate + crack), words));
  CHECK(!contains(run(replaced(plate, "velocity = [0.1", "velocity = [-0.1")), words));
}
