#include "perikit/plugin/parameters.hpp"

#include <doctest/doctest.h>

#include "scene/scene.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

TEST_CASE("kinds have names, and back") {
  for (const Kind kind : all_kinds) CHECK(kind_from_name(name(kind)) == kind);
  CHECK(!kind_from_name("materials"));
}

TEST_CASE("a parameter prints what it allows") {
  ParameterTable table;
  CHECK(allowed(table.number("a", "m", "").positive()) == "a number > 0 [m]");
  CHECK(allowed(table.number("b", "-", "").above(-1).below(0.5)) == "a number > -1 and < 0.5");
  CHECK(allowed(table.integer("c", "").at_least(1)) == "an integer >= 1");
  CHECK(allowed(table.choice("d", {"strain", "stress"}, "")) == "\"strain\" or \"stress\"");
  CHECK(allowed(table.expression("e", "Pa", "").with_time()) == "a number [Pa], or an expression in x, y, z, t");
  CHECK(allowed(table.add(ParameterType::integers, "f", "-", "").length(1, 3)) == "a list of integers (1 to 3)");
  CHECK(table.find("c") != nullptr);
  CHECK(table.find("g") == nullptr);
}

TEST_CASE("elastic tables hold density and five constants of which two are given") {
  const ParameterTable elastic = elastic_parameters(), rubber = rubber_parameters();
  CHECK(elastic.find("density")->unit == "kg/m^3");
  CHECK(!elastic.find("density")->required);
  CHECK(elastic.find("density")->per_point);
  CHECK(elastic.groups().front().count == 2);
  CHECK(elastic.groups().front().names.size() == 5);
  CHECK(rubber.find("volumetric")->default_text == "\"quadratic\"");
  CHECK(rubber.find("lame_lambda") != nullptr);
}

TEST_CASE("values know what the scene gave and where") {
  FakeCatalogue parts;
  const auto verlet = parse_part(Kind::integrator, "verlet", "end_time = 2", parts);
  CHECK(verlet->values.number("end_time") == 2.0);
  CHECK(verlet->values.given("end_time"));
  CHECK(verlet->values.number("safety") == 0.8);
  CHECK(!verlet->values.given("safety"));
  CHECK(!verlet->values.has("time_step"));
  CHECK(verlet->values.position("end_time").line == 1);
  CHECK(verlet->values.position("end_time").column == 12);
  CHECK(std::string(verlet->values.error("end_time", "too long").what()) ==
        "integrator/verlet:1:12: integrator.end_time: too long");
}

TEST_CASE("a default gives way to the other member of its group") {
  FakeCatalogue parts;
  const auto verlet = parse_part(Kind::integrator, "verlet", "end_time = 2.0\ntime_step = 0.1", parts);
  CHECK(!verlet->values.has("safety"));
}

TEST_CASE("material parameters are numbers or expressions") {
  FakeCatalogue parts;
  const auto material = parse_part(Kind::material, "neo_hookean", "shear_modulus = 2\nbulk_modulus = \"1 + x\"", parts);
  CHECK(std::get<double>(material->values.expression("shear_modulus")) == 2.0);
  CHECK(std::get<std::string>(material->values.expression("bulk_modulus")) == "1 + x");
  CHECK(contains(message_of([&] { (void)material->values.number("bulk_modulus"); }),
                 "2:16: material.bulk_modulus: found an expression"));
  CHECK_THROWS_AS((void)material->values.number("nothing"), std::logic_error);
  CHECK_THROWS_AS((void)material->values.integer("volumetric"), std::logic_error);
}

TEST_CASE("errors of a part table name key, found and allowed") {
  FakeCatalogue parts;
  const auto errors = [&](const std::string& toml) {
    return message_of([&] { parse_part(Kind::material, "saint_venant_kirchhoff", toml, parts); });
  };
  CHECK(contains(errors("youngs_modulus = 1"),
                 "material: found youngs_modulus only; allowed: exactly 2 of youngs_modulus, poisson_ratio"));
  CHECK(contains(errors(""), "found none of them; allowed: exactly 2"));
  CHECK(contains(errors("youngs_modulus = 1\npoisson_ratio = 0.2\nbulk_modulus = 1"),
                 "found youngs_modulus, poisson_ratio, bulk_modulus; allowed"));
  CHECK(contains(errors("youngs_modulus = 1\npoisson_ratio = 0.5"),
                 "2:17: material.poisson_ratio: found the number 0.5; allowed: a number > -1 and < 0.5"));
  CHECK(contains(errors("youngs_modulus = 1\npoisson_ration = 0.3"), "2:1: material.poisson_ration: found an unknown key"));
  CHECK(contains(errors("youngs_modulus = 1\npoisson_ration = 0.3"), "did you mean 'poisson_ratio'?"));
  CHECK(contains(errors("youngs_modulus = "), ":1:"));
}
