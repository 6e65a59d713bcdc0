/// Scenes that say what can hardly be meant: each a warning that names the key, or an error.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "robustness/desk.hpp"
#include "tests/kit/scene_text.hpp"

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
  for (const std::string segment : {"[[3.5, -1], [3.5, 2]]", "[[-1, 5], [3, 1]]"})
    warned(plate + "[[crack]]\nsegment = " + segment + "\n", "", "crack.0 (line 44) passes through points of the body, which all count to one side of it");
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
  silent(plate, "--set family.horizon_ratio=1.015 --set family.influence=constant --set 'run.silence=[\"horizon\"]'");
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
  std::string columns;
  for (const std::string reduce : {"min", "max", "mean", "sum"})
    columns += fmt::format("{{ name = \"{}_of_condition\", set = \"all\", quantity = \"shape_tensor_condition\", reduce = \"{}\" }}, ", reduce, reduce);
  const Desk desk(replaced(replaced(replaced(plate, "frames = 5", "frames = 5\nfields = [\"displacement\", \"shape_tensor_condition\"]"), "history = [", "history = [\n  " + columns),
                           "upper = [8, 5]\n", "upper = [12, 5]\ninside = \"x < 8 || (x > 11 && y < 1)\"\n"));
  const Result run = desk.perikit("run scene.toml -o out");
  CHECK_MESSAGE(run.status == 0, run.err);
  CHECK_MESSAGE(
      contains(run.out,
               "warning: frame 0: shape_tensor_condition is not finite at point 8 (in input order), whose family is too poor"),
      run.out);
  for (const std::string reduce : {"max", "mean", "sum"})
    CHECK_MESSAGE(contains(run.out, "warning: history column " + reduce + "_of_condition is inf at t = 0: a point of its set has a family too poor"), run.out);
  CHECK(!contains(run.out, "column min_of_condition"));
  CHECK(contains(desk.text("out/history.csv"), ",inf,inf,inf,"));
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

TEST_CASE("questionable: a box that is no multiple of the spacing") {
  const auto box = [](const std::string& spacing, const std::string& upper) {
    return replaced(replaced(plate, "spacing = 1.0", "spacing = " + spacing), "upper = [8, 5]", "upper = " + upper);
  };
  const std::string words = "the box of [body.lattice] is ";
  warned(box("0.3", "[8, 5]"), "",
         words + "26.6667 by 16.6667 spacings, which are not whole numbers: the body is 8.1 by 5.1 m, not 8 by 5 m; spacing = 0.25 or 0.333333 would fit");
  warned(box("1.0", "[8, 5.2]"), "", words + "8 by 5.2 spacings, which are not whole numbers: the body is 8 by 5 m, not 8 by 5.2 m; spacing = 0.4 would fit");
  // Two lengths without a common measure nearby.
  warned(box("1.0", "[8, 5.0123]"), "", words + "8 by 5.0123 spacings, which are not whole numbers: the body is 8 by 5 m, not 8 by 5.0123 m; no spacing nearby fits, upper = [8, 5] does");
  // What a spacing is rounded to, and boxes that `inside` has cut before they end.
  silent(box("0.33333", "[8, 5]"));
  silent(box("\"1/3\"", "[8, 5]"));
  silent(replaced(box("1.0", "[8.3, 5]"), "lower = [0, 0]", "lower = [0, 0]\ninside = \"x < 7\""));
  // A run says so, too.
  const Desk desk(box("1.0", "[8.4, 5]"));
  const Result run = desk.perikit("run scene.toml -o out");
  CHECK_MESSAGE(contains(run.out, words + "8.4 by 5 spacings"), run.out);
}

TEST_CASE("questionable: laws for small strains, and penalties that do not turn, in bodies that leave small strains and rotations") {
  const std::string spinning = SceneText{.lower = {-4, -2}, .upper = {4, 2}, .kinematics = "type = \"conventional\"\nstabilization = \"silling\"",
                                         .material = "type = \"linear_elastic\"\ndensity = 1.0\nyoungs_modulus = 100.0\npoisson_ratio = 0.3",
                                         .further = "[initial]\ndisplacement = [\"0.02*x\", \"0\"]\nvelocity = [\"-0.2*y\", \"0.2*x\"]\n[output]\nframes = 4",
                                         .integrator = "type = \"verlet\"\nend_time = 1.0"};
  const auto told = [](const std::string& scene, const std::string& options) {
    const Desk desk(scene);
    const Result run = desk.perikit("run scene.toml -o out " + options);
    CHECK_MESSAGE(run.status == 0, run.err);
    return run.out;
  };
  const std::string first = "warning: time 0.5: a strain of 0.01", last = "warning: strains or rotations were not small in 3 of 5 frames, at most 0.20";
  const std::string linear = told(spinning, "");
  CHECK_MESSAGE(contains(linear, first), linear);
  CHECK_MESSAGE(contains(linear, last), linear);
  CHECK_MESSAGE(contains(linear, "with material \"linear_elastic\" (for small strains and rotations"), linear);
  CHECK_MESSAGE(contains(linear, "beyond them saint_venant_kirchhoff and hencky take the same constants)"), linear);
  // Half of the time, and a law that turns with the body.
  CHECK(contains(told(spinning, "--set integrator.end_time=0.3"), "warnings      none"));
  CHECK(contains(told(spinning, "--set material.type=hencky"), "warnings      none"));
  // The penalty alone does not turn.
  const std::string wan = told(spinning, "--set material.type=hencky --set kinematics.stabilization=wan");
  CHECK_MESSAGE(contains(wan, "with stabilization \"wan\""), wan);
  // Statics: strains, in the equilibrium that is found.
  std::string pulled = replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [2.0, \"free\"]");
  pulled = replaced(pulled, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0", "type = \"newton\"\nsteps = 4");
  pulled = replaced(pulled, "type = \"neo_hookean\"", "type = \"linear_elastic\"");
  CHECK_MESSAGE(contains(told(pulled, ""), "strains or rotations were not small in "), pulled);
  // Pulled so little that strains are small.
  CHECK(contains(told(pulled, "--set boundary.1.displacement=[0.2,0]"), "warnings      none"));
}

TEST_CASE("questionable: bonds that weaken in a zone too short for the spacing, in statics") {
  std::string pulled = replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [0.1, \"free\"]");
  pulled = replaced(pulled, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0", "type = \"newton\"\nsteps = 4");
  const std::string damage = "[damage]\ntype = \"critical_energy\"\nenergy_release_rate = 1.0\nsoftening = ";
  const auto with = [&](const std::string& scene, const std::string& softening) { return replaced(scene, "[output]", damage + softening + "\n[output]"); };
  warned(with(pulled, "1"), "", "damage (line 39) breaks bonds at once, and in a quasi-static run what their neighbours spring back is lost");
  // Means of 2/3 of the horizon, and of 11/30 of it.
  warned(with(pulled, "4"), "", "damage (line 39) lets bonds weaken in a zone that is short beside the spacing (softening = 4)");
  silent(with(pulled, "6"));
  warned(with(pulled, "6"), "--set family.influence=cubic_spline", "damage (line 39) lets bonds weaken in a zone");
  silent(with(pulled, "6"), "--set family.influence=cubic_spline --set kinematics=bond_based --set 'material={type=\"linear_elastic\",youngs_modulus=1.0,poisson_ratio=0.25}' --set 'run.silence=[\"pair_law\"]'");
  silent(with(plate, "1"));
}

TEST_CASE("questionable: nearly incompressible bodies without selective") {
  const std::string stiff = replaced(plate, "bulk_modulus = 2.0", "bulk_modulus = 80.0");
  const std::string words = "the bulk modulus is 100 times the shear modulus (Poisson's ratio 0.495017), and kinematics \"baqp\" locks";
  warned(stiff, "--set integrator.time_step=1e-3", words);
  warned(replaced(replaced(plate, "shear_modulus = 0.8", "shear_modulus = 1.0"), "bulk_modulus = 2.0", "poisson_ratio = 0.4999"), "--set integrator.time_step=1e-3",
         "the bulk modulus is 5000 times the shear modulus");
  // One gradient per point with a penalty locks sooner.
  warned(plate, "--set material.bulk_modulus=20 --set 'kinematics={type=\"conventional\",stabilization=\"silling\"}' --set integrator.time_step=1e-3",
         "the bulk modulus is 25 times the shear modulus");
  silent(plate, "--set material.bulk_modulus=20 --set integrator.time_step=1e-3");
  silent(stiff, "--set integrator.time_step=1e-3 --set 'kinematics={type=\"selective\",base=\"baqp\"}'");
  silent(replaced(stiff, "plane = \"strain\"", "plane = \"stress\"\nthickness = 1.0"), "--set integrator.time_step=1e-3");
}

TEST_CASE("questionable: one gradient per point without a stabilization") {
  warned(plate, "--set kinematics=conventional", "one gradient per point without a stabilization");
  silent(plate, "--set 'kinematics={type=\"conventional\",stabilization=\"silling\"}' --set integrator.time_step=1e-3");
}

TEST_CASE("questionable: bodies on which nothing acts") {
  const std::string words = "nothing acts on the body, which stays at rest";
  const std::string still = replaced(plate, "velocity = [0.1, \"free\"]", "velocity = [0, \"free\"]");
  warned(still, "", words);
  warned(still + "[[load]]\nset = \"all\"\nforce = [0, \"0\"]\n", "", words);
  warned(replaced(plate, "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n", ""), "", words);
  silent(still + "[[load]]\nset = \"all\"\nbody_force = [0, 1e-9]\n");
  silent(still + "[initial]\nvelocity = [0, \"x > 3 && x < 5\"]\n");
  silent(still, "--set integrator={type=\\\"evaluate\\\"}");
}

TEST_CASE("questionable: constants that are not used") {
  const std::string used = replaced(plate, "[body]\n", "[constants]\nE = 1\nF = \"2*E\"\nlong_name = 3\n\n[body]\n");
  warned(used, "", "constants.F (line 6) is not used in the scene");
  warned(used, "", "constants.long_name (line 7) is not used in the scene");
  silent(replaced(replaced(used, "spacing = 1.0", "spacing = \"F/2\""), "long_name = 3\n", ""));
}

TEST_CASE("questionable: sets that rounding decides, and sets of one point") {
  const auto left = [](const std::string& condition) { return replaced(plate, "left = \"x < 2\"", "left = \"" + condition + "\""); };
  warned(left("x < 1.5"), "", "the limit of sets.left (line 13) passes through points of the lattice");
  warned(left("x <= 1.5"), "", "the limit of sets.left (line 13) passes through points of the lattice");
  const std::string loaded = replaced(plate, "left = ", "corner = \"x < 1 && y < 1\"\nleft = ") + "[[load]]\nset = \"corner\"\nbody_force = [\"x > 7\", 0]\n";
  warned(replaced(loaded, "x < 1 && y", "x > 3 && x < 4 && y"), "", "sets.corner (line 13) has one point, on which a load acts");
  silent(left("x < 1.500001"));
  silent(replaced(left("x < 2"), "right = ", "unused = \"x < 1.5\"\nright = "));
  silent(replaced(plate, "left = \"x < 2\"", "left = { nearest = [0, 0] }"));
  const auto stiff = [](const std::string& condition) {
    return replaced(plate, "left = ", "stiff = \"" + condition + "\"\nleft = ") + "[[region]]\nset = \"stiff\"\nmaterial = { type = \"linear_elastic\", density = 1, youngs_modulus = 3, poisson_ratio = 0.25 }\n";
  };
  warned(stiff("x + y > 7"), "", "the limit of sets.stiff (line 13) passes through points of the lattice");
  silent(stiff("x > 4 && y > 2"));
  const auto cut = [](const std::string& inside) { return replaced(plate, "spacing = 1.0\n", "spacing = 1.0\ninside = \"" + inside + "\"\n"); };
  for (const char* inside : {"x < 7.5 || y < 2", "x <= 7.5 || y < 2"}) warned(cut(inside), "", "the surface of [body.lattice] inside passes through points of the lattice");
  silent(cut("x < 7 || y < 2"));
}

TEST_CASE("questionable: horizons below two spacings") {
  warned(plate, "--set family.horizon_ratio=1.515", "family.horizon_ratio is 1.515 spacings: families are the nearest neighbours and hardly more");
  silent(plate, "--set family.horizon_ratio=2.0");
}

TEST_CASE("questionable: warnings are turned off by name") {
  const std::string strange = replaced(replaced(plate, "upper = [8, 5]", "upper = [8.3, 5]"), "[body]\n", "[constants]\nE = 1\n\n[body]\n");
  warned(strange, "", "constants.E (line 5) is not used in the scene [unused_constant]");
  warned(strange, "--set 'run.silence=[\"unused_constant\"]'", "the box of [body.lattice]");
  silent(strange, "--set 'run.silence=[\"unused_constant\",\"box\"]'");
  refused(strange, "--set 'run.silence=[\"unused\"]'", "run.silence.0: found the string \"unused\"; allowed: \"balance\", \"box\"");
  const Desk desk(strange);
  const Result run = desk.perikit("run scene.toml -o out --set 'run.silence=[\"unused_constant\",\"box\"]'");
  CHECK_MESSAGE(contains(run.out, "warnings      none"), run.out);
  // Those of the run itself, too.
  const std::string through = replaced(plate, "velocity = [0.1", "velocity = [-0.5") + "[[crack]]\nsegment = [[4, -1], [4, 6]]\n[initial]\nvelocity = [\"x > 4 ? -0.5 : 0\", 0]\n";
  const Result crossed = Desk(through).perikit("run scene.toml -o out --set 'run.silence=[\"contact\"]'");
  CHECK_MESSAGE(contains(crossed.out, "warnings      none"), crossed.out);
}

TEST_CASE("questionable: what a pair law, a criterion, a force state and [output] cannot give") {
  warned(plate, "--set kinematics=bond_based", "bond_based has Poisson's ratio 1/4 in this body");
  const std::string held = replaced(plate, "[integrator]", "[damage]\ntype = \"critical_energy\"\nenergy_release_rate = 1.0\nenergy = \"held\"\n\n[integrator]");
  warned(held, "", "a criterion by the energy that bonds hold, with gradients");
  const std::string stretch = replaced(plate, "[integrator]", "[damage]\ntype = \"critical_stretch\"\nstretch = 1.0\nsecond_law = false\n\n[integrator]");
  warned(stretch, "--set kinematics=sub_horizon", "gradients of parts of families: updates of bonds that fail create energy");
  warned(plate, "--set 'kinematics={type=\"bond_associated\",force_state=\"local\"}'", "local force state: forces are not the derivative of the energy");
  const Desk desk(replaced(plate, "frames = 5", "times = [0.5, 2.0]"));
  const Result run = desk.perikit("run scene.toml -o out");
  CHECK_MESSAGE(contains(run.out, "warning: [output] times: 2 lies after the end of the run, 1: no frame [output_times]"), run.out);
}

TEST_CASE("questionable: criteria of stress between materials of unlike stiffness") {
  const auto with = [](const std::string& stiffer, const std::string& more) {
    return replaced(plate, "[output]",
                    "[[region]]\nset = \"right\"\nmaterial = { type = \"neo_hookean\", density = 1.0, shear_modulus = " + stiffer + ", bulk_modulus = 2.0 }\n[damage]\ntype = \"max_stress\"\nstrength = 1.0\n" +
                        more + "\n[output]");
  };
  warned(with("80.0", ""), "", "damage \"max_stress\" looks at stresses of bonds between materials of 1 : 35.4 in stiffness, which are off there");
  silent(with("1.6", ""));
  silent(with("80.0", "no_fail = [\"right\"]"));
  silent(replaced(replaced(with("80.0", ""), "max_stress", "critical_stretch"), "strength", "stretch"));
}

TEST_CASE("questionable: pair laws whose bonds do not add up to the material, by how much") {
  // Poisson's ratio of the plate is not theirs, which is another warning of the same kind.
  const std::string square = replaced(plate, "upper = [8, 5]", "upper = [20, 20]");
  const auto words = [](const char* of_stretch, const char* of_all, const char* of_shear, const char* of_other) {
    return fmt::format("inside the body bonds store {} in a stretch along an axis, {} in an equal stretch in all directions, {} in a shear along the axes, {} in a shear at 45 degrees to them "
                       "times the energy of the material",
                       of_stretch, of_all, of_shear, of_other);
  };
  warned(square, "--set 'kinematics={type=\"bond_based\",surface_correction=\"none\"}'", words("1.15", "1.03", "0.66", "1.40"));
  warned(square, "--set 'kinematics={type=\"ordinary\",surface_correction=\"none\"}' --set family.influence=cubic_spline --set family.horizon_ratio=3.015", words("1.02", "1.00", "0.91", "1.09"));
  silent(square, "--set 'kinematics={type=\"ordinary\",surface_correction=\"none\"}' --set family.influence=cubic_spline --set family.horizon_ratio=4.015");
  silent(square, "--set 'kinematics={type=\"ordinary\",surface_correction=\"moments\"}' --set family.influence=cubic_spline --set family.horizon_ratio=3.015");
  silent(square, "--set 'kinematics={type=\"bond_based\",surface_correction=\"none\"}' --set 'run.silence=[\"pair_law\"]'");
  silent(square);
  const std::string rod = "format = 1\n[body]\ndimension = 1\n[body.lattice]\nspacing = 1.0\nlower = [0]\nupper = [30]\n[family]\nhorizon_ratio = 3.015\n[kinematics]\ntype = \"bond_based\"\n"
                          "[material]\ntype = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.25\n[integrator]\ntype = \"evaluate\"\n";
  silent(rod);
  warned(rod, "--set 'kinematics.surface_correction=\"none\"'", "inside the body bonds store 1.32 in a stretch along an axis times");
}

TEST_CASE("questionable: thin bodies, by how much they are off in bending") {
  const auto strip = [](const std::string& upper) { return replaced(plate, "upper = [8, 5]", "upper = " + upper); };
  warned(strip("[40, 4]"), "", "the body has 4 points across along y: bent uniformly it stores 0.77 times the energy of the material, and deflections come out too large by about as much");
  warned(strip("[40, 4]"), "--set 'kinematics={type=\"conventional\",stabilization=\"silling\"}'", "the body has 4 points across along y: bent uniformly it stores 3.01 times");
  silent(strip("[40, 4]"), "--set 'kinematics={type=\"projection\",order=2}'");
  silent(strip("[40, 4]"), "--set 'run.silence=[\"thin\"]'");
  silent(strip("[80, 9]"));
  silent(strip("[12, 4]"));   // nothing that bends
  silent(strip("[40, 4]") + "[[symmetry]]\naxis = \"y\"\n");   // half of a body of 8
}

TEST_CASE("questionable: surfaces that are stairs on a lattice") {
  const auto with = [](const std::string& inside) { return replaced(plate, "upper = [8, 5]", "upper = [30, 20]\ninside = \"" + inside + "\""); };
  for (const std::string inside : {"(x - 15)^2 + (y - 10)^2 > 25", "y < 12 + 0.2*x", "x + y < 40.3"}) warned(with(inside), "", "a surface of [body.lattice] inside cuts cells obliquely");
  silent(with("(x - 15)^2 + (y - 10)^2 > 25"), "--set family.partial_volume=true");
  silent(with("(x - 15)^2 + (y - 10)^2 > 25"), "--set body.lattice.jitter=0.1");
  silent(with("(x - 15)^2 + (y - 10)^2 > 25"), "--set 'run.silence=[\"stairs\"]'");
  silent(with("x < 25 || y < 10"));
  silent(with("abs(x - 15) > 4.2 || abs(y - 10) > 3.3"));
}

TEST_CASE("questionable: forces on plates of a forgotten thickness, and places far from any point") {
  const std::string small = replaced(replaced(plate, "spacing = 1.0", "spacing = 0.01"), "upper = [8, 5]", "upper = [0.08, 0.05]");
  const std::string held = replaced(replaced(replaced(small, "x < 2", "x < 0.02"), "x > 6", "x > 0.06"), "time_step = 0.02\n", "");
  const std::string plate_in_metres =
      replaced(replaced(held, "plane = \"strain\"", "plane = \"stress\""), "[sets]", "[sets]\nmiddle = \"x > 0.02 && x < 0.06 && y > 0.004\"") + "[[load]]\nset = \"middle\"\nforce = [0, 1]\n";
  warned(plate_in_metres, "", "a force acts on a body in plane stress that is 1 m thick and 0.08 m long");
  silent(plate_in_metres, "--set body.thickness=0.01");
  const auto with = [](const std::string& place) { return replaced(plate, "[sets]", "[sets]\ngauge = { nearest = " + place + " }"); };
  warned(with("[40, 25]"), "", "the point of sets.gauge (line 13) is 38.");
  silent(with("[8.9, 2.5]"));
}

TEST_CASE("questionable: expressions without quotes are told of") {
  refused(replaced(plate, "spacing = 1.0", "spacing = dx"), "", "could not determine value type; texts and expressions stand in quotes");
}

TEST_CASE("questionable: materials that soften, and what plastic materials must be given") {
  const auto with = [](const std::string& keys) -> std::string {
    return SceneText{.upper = {8, 5}, .sets = "left = \"x < 2\"\nright = \"x > 6\"", .material = "type = \"j2\"\ndensity = 1\nyoungs_modulus = 2\npoisson_ratio = 0.3\n" + keys,
                     .further = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"right\"\ndisplacement = [0.1, 0]\n", .integrator = "type = \"newton\""};
  };
  silent(with("yield_stress = 0.01"));
  silent(with("yield_stress = 0.01\nhardening = 0.1\nsaturation_stress = 0.02\nsaturation_rate = 20"));
  for (const std::string soft : {"hardening = -0.001", "hardening = -0.01\nsaturation_stress = 0.02\nsaturation_rate = 20", "hardening = \"-0.02*(x > 5)\""})
    warned(with("yield_stress = 0.01\n" + soft), "", "the material \"j2\" softens, and has no length of its own");
  silent(with("yield_stress = 0.01\nhardening = -0.001"), "--set 'run.silence=[\"softening\"]'");
  refused(with("hardening = 0.1"), "", "yield_stress");
  refused(with("yield_stress = -0.1"), "", "material.yield_stress: found the number -0.1; allowed: a number > 0 [Pa]");
  refused(with("yield_stress = 0.01\nsaturation_stress = 0.005\nsaturation_rate = 1"), "", "found saturation_stress = 0.005; allowed: a finite value that is not below yield_stress");
  refused(with("yield_stress = 0.01\nsaturation_stress = 0.05"), "", "found saturation_rate = 0; allowed: a value > 0 where saturation_stress is above yield_stress");
  refused(with("yield_stress = 0.01\nhardening = -3"), "", "found hardening = -3; allowed: a finite value above -3 times the shear modulus");
  refused(with("yield_stress = 0.01"), "--set kinematics.type=ordinary", "with kinematics \"ordinary\", a pair law, which takes elastic constants from it and nothing else; allowed: an elastic material, or a kinematics with gradients");
}
