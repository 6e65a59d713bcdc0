/// What laws remember as point fields: in frames, history, pictures and descriptions, and what is refused.

#include "files/hdf5_file.hpp"
#include "robustness/desk.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// A bar of two laws, of which the left one remembers, pulled in explicit steps.
std::string bar(const std::string& fields, const std::string& history = "", int dimension = 2) {
  std::vector<double> upper{8, 5, 4};
  upper.resize(static_cast<std::size_t>(dimension));
  const std::string law = "density = 1, youngs_modulus = 1, poisson_ratio = 0.3 }\n";
  return SceneText{.dimension = dimension, .upper = upper, .sets = "left = \"x < 2\"\nright = \"x > 6\"\nhalf = \"x > 4\"",
                   .material = "type = \"hypoelastic\"\ndensity = 1\nyoungs_modulus = 1\npoisson_ratio = 0.3",
                   .further = "[[region]]\nset = \"half\"\nmaterial = { type = \"hencky\", " + law + "[initial]\nvelocity = [\"0.01*x\"" + (dimension > 1 ? ", 0" : "") + (dimension > 2 ? ", 0" : "") +
                              "]\n[output]\nframes = 2\nhistory_every = 1\nfields = [" + fields + "]\nhistory = [" + history + "]\n",
                   .integrator = "type = \"verlet\"\nend_time = 2.0"};
}

hdf5::Source::Array field(const Desk& desk, const std::string& name) { return hdf5::Source(desk.path("out/frames/00000002.h5")).read(name); }

}  // namespace

TEST_CASE("states: fields of frames, zero where the law has none, with their unit") {
  for (int d = 1; d <= 3; ++d) {
    CAPTURE(d);
    const Desk desk(bar("\"cauchy\", \"deformation_gradient\", \"state:unrotated_stress\", \"state:work\", \"state:stretch\"",
                        "{ name = \"most\", quantity = \"state:work\", reduce = \"max\" }, { name = \"pull\", set = \"left\", quantity = \"state:unrotated_stress\", component = \"xx\" }", d));
    const Result run = desk.perikit("run scene.toml --quiet -o out");
    REQUIRE_MESSAGE(run.status == 0, run.err);
    const hdf5::Source frame(desk.path("out/frames/00000002.h5"));
    CHECK(frame.text("/state_unrotated_stress", "unit") == "Pa");
    CHECK(frame.text("/state_work", "unit") == "J/m^3");
    const auto stress = field(desk, "state_unrotated_stress"), cauchy = field(desk, "cauchy"), work = field(desk, "state_work"), stretch = field(desk, "state_stretch"),
               F = field(desk, "deformation_gradient");
    CHECK(work.shape == std::vector<std::size_t>{work.data.size()});
    REQUIRE(stress.width() == 9);
    double scale = 0, most = 0;
    for (const double s : cauchy.data) scale = std::max(scale, std::abs(s));
    CHECK(scale > 0);
    const auto id = hdf5::Source(desk.path("out/reference.h5")).read("material_id").data;
    std::size_t remembering = 0;
    for (std::size_t p = 0; p < work.data.size(); ++p) {
      const double *const s = &stress.data[9 * p], *const c = &cauchy.data[9 * p], *const U = &stretch.data[9 * p], *const f = &F.data[9 * p];
      if (id[p] != 0) {
        CHECK((work.data[p] == 0 && s[0] == 0 && U[0] == 0));
        continue;
      }
      ++remembering;
      most = std::max(most, work.data[p]);
      CHECK(work.data[p] > 0);
      // sigma = R s R^T: the same trace at every evaluation point.
      CHECK(s[0] + s[4] + s[8] == doctest::Approx(c[0] + c[4] + c[8]).epsilon(1e-12 * scale));
      CHECK((s[1] == s[3] && s[2] == s[6] && s[5] == s[7]));
      if (d == 1) CHECK(U[0] == doctest::Approx(f[0] - 1).epsilon(1e-13));
      if (d < 3) CHECK((s[2] == 0 && s[5] == 0));
    }
    CHECK((remembering > 0 && remembering < work.data.size()));
    const std::string last = lines(desk.text("out/history.csv")).back();
    CHECK_MESSAGE(contains(last, fmt::format(",{},", most)), last);
  }
}

TEST_CASE("states: pictures and descriptions name them with their unit") {
  const Desk desk(bar("\"state:work\", \"state:stretch\""));
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  CHECK(desk.perikit("plot out --field state:work -o work.svg").status == 0);
  for (const std::string word : {"work", "J/m^3"}) CHECK_MESSAGE(contains(desk.text("work.svg"), word), "no ", word);
  CHECK(desk.perikit("plot out --field state:stretch --component xx").status == 0);
  CHECK(fs::exists(desk.path("out/state_stretch_xx_00000002.png")));
  const Result missing = desk.perikit("plot out --field state:stres");
  CHECK(missing.status == 2);
  CHECK_MESSAGE(contains(missing.err, "found 'state:stres'; this run has state:stretch, state:work, volume"), missing.err);
  CHECK(contains(desk.text("out/results.xdmf"), "<Attribute Name=\"state:work\" AttributeType=\"Scalar\" Center=\"Node\"><DataItem Format=\"HDF\" NumberType=\"Float\" Precision=\"8\" "
                                                "Dimensions=\"40\">frames/00000002.h5:/state_work</DataItem>"));
  const std::string described = desk.perikit("describe material/hypoelastic").out;
  for (const std::string line : {"States (point fields)", "  state:stretch                [-] symmetric tensor", "  state:unrotated_stress       [Pa] symmetric tensor",
                                 "  state:work                   [J/m^3] number"})
    CHECK_MESSAGE(contains(described, line), "no '", line, "' in\n", described);
  CHECK(!contains(desk.perikit("describe material/hencky").out, "States"));
}

TEST_CASE("states: a state that no material of the scene has is refused with those that there are") {
  struct Fault {
    std::string scene;
    std::vector<std::string> words;
  };
  const std::string known = "allowed: \"state:stretch\", \"state:unrotated_stress\", \"state:work\"";
  std::string elastic = bar("\"state:work\"");
  elastic = replaced(elastic, "type = \"hypoelastic\"", "type = \"neo_hookean\"");
  std::string pairs = bar("\"state:work\"");
  pairs = replaced(pairs, "\"baqp\"", "\"ordinary\"");
  for (const auto& [scene, words] :
       {Fault{bar("\"displacement\",\n\"state:strech\""), {"scene.toml:31:1: output.fields.1: found \"state:strech\"; " + known + "; did you mean 'state:stretch'?"}},
        Fault{bar("\"displacement\"", "{ name = \"a\", quantity = \"state:strain\" }"), {"scene.toml:31:37: output.history.0.quantity: found \"state:strain\"; " + known}},
        Fault{bar("\"displacement\"", "{ name = \"a\", quantity = \"state:stretch\" }"), {"output.history.0.component: found nothing; allowed: xx, xy"}},
        Fault{bar("\"displacement\"", "{ name = \"a\", quantity = \"state:work\", component = \"xx\" }"), {"output.history.0.component: found \"xx\" of state:work, which is a scalar"}},
        Fault{elastic, {"output.fields.0: found \"state:work\"; allowed: fields without state:, as neo_hookean and hencky remembers nothing"}},
        Fault{bar("\"stat:work\""), {"output.fields.0: found the string \"stat:work\"; allowed: \"displacement\"", "\"fragment\" or \"state:NAME\""}},
        Fault{pairs, {"output.fields: found \"state:work\", but kinematics \"ordinary\" is a pair law"}}}) {
    const Desk desk(scene);
    for (const std::string command : {"check scene.toml", "run scene.toml -o out"}) {
      const Result result = desk.perikit(command);
      INFO(result.err);
      CHECK(result.status == 2);
      for (const std::string& word : words) CHECK_MESSAGE(contains(result.err, word), "no '", word, "'");
    }
  }
}
