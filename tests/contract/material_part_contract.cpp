/// The material contract (material_contract.hpp) for every registered material, with the constants of each of its example tables.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/contract/fixture.hpp"
#include "tests/contract/material_contract.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

std::shared_ptr<const PartValues> values_of(const Example& example) {
  return parse_part(Kind::material, example.part, example.table, subject().registry);
}

const Parameter& declared(const Example& example, const std::string& key) {
  return *subject().registry.describe(Kind::material, example.part).parameters.find(key);
}

/// Constants from the example's values at the origin, with every parameter in Pa multiplied.
std::vector<double> constants_of(const Material& material, const Example& example, double factor_of_moduli = 1.0) {
  const auto part = values_of(example);
  std::map<std::string, double, std::less<>> numbers;
  for (const std::string& key : part->values.keys()) {
    const ParameterValue* value = part->values.find(key);
    if (const auto* number = std::get_if<double>(value)) numbers[key] = *number;
    else if (part->values.is_expression(key)) numbers[key] = Expression(part->values.text(key), {}, false, {}, key)({});
    else continue;
    if (declared(example, key).unit == "Pa") numbers[key] *= factor_of_moduli;
  }
  std::vector<double> constants(static_cast<std::size_t>(material.traits().constants), std::numeric_limits<double>::quiet_NaN());
  material.constants({[&](std::string_view key) { return numbers.contains(key); }, [&](std::string_view key) { return numbers.find(key)->second; }},
                     constants.data());
  return constants;
}

std::string label(const Example& example) { return fmt::format("{} ({})", example.part, example.table); }

/// check(material, constants, options) for every example.
template <class Check>
void for_every_example(const Check& check) {
  for (const Example& example : examples(Kind::material)) {
    INFO(label(example));
    const auto material = subject().registry.material(*values_of(example));
    const std::vector<double> constants = constants_of(*material, example);
    MaterialOptions options{.law = label(example), .smallest_strain = subject().third_party ? 1e-6 : 1e-10};
    // A constant that grows with the parameters in Pa is a modulus; the others must not notice the unit of stress.
    constexpr double factor = 1024.0;
    const std::vector<double> scaled = constants_of(*material, example, factor);
    for (std::size_t k = 0; k < constants.size(); ++k) {
      const double size = std::abs(constants[k]);
      const bool modulus = std::abs(scaled[k] - factor * constants[k]) <= 1e-12 * factor * size;
      CHECK_MESSAGE((modulus || std::abs(scaled[k] - constants[k]) <= 1e-12 * size), "constant ", k, " depends on the unit of stress: ", constants[k],
                    " becomes ", scaled[k], " where all moduli are multiplied by ", factor);
      options.moduli.push_back(modulus);
    }
    check(*material, constants, options);
  }
}

void in_every_space(void (MaterialContract::*identity)()) {
  for_every_example([&](const Material& material, const std::vector<double>& constants, const MaterialOptions& options) {
    check_material(material, constants, options, identity);
  });
}

}  // namespace

TEST_CASE("material: no energy and no stress at rest, and linear elasticity for small strains") {
  in_every_space(&MaterialContract::reference_state);
  in_every_space(&MaterialContract::small_strains);
}

TEST_CASE("material: stress is the derivative of the energy, the tangent that of the stress") { in_every_space(&MaterialContract::derivatives); }

TEST_CASE("material: the tangent action is the tangent times its direction, and free stresses are zero") { in_every_space(&MaterialContract::tangent_action); }

TEST_CASE("material: plane and uniaxial stress are plane and uniaxial strain at the stretch that they report") { in_every_space(&MaterialContract::free_stretches); }
TEST_CASE("material: the promise that lateral components vanish changes nothing but the cost") { in_every_space(&MaterialContract::confined); }

TEST_CASE("material: a law that tells shape and volume apart is the sum of both") { in_every_space(&MaterialContract::volumes); }

TEST_CASE("material: a law that is linear in the Green strain grows as such laws do") { in_every_space(&MaterialContract::growth); }

TEST_CASE("material: a batch is its points one at a time, writes all of its outputs and nothing else") { in_every_space(&MaterialContract::batches); }

TEST_CASE("material: stress turns with the body, and an isotropic law has no directions") { in_every_space(&MaterialContract::rotations); }

TEST_CASE("material: stress, energy and tangent have the unit of the moduli") { in_every_space(&MaterialContract::units); }

TEST_CASE("material: an inadmissible deformation is named, and its neighbours do not notice") { in_every_space(&MaterialContract::inadmissible); }

TEST_CASE("material: a law with history follows paths: objective, exact tangent, its history in its own place, its energy accounted for") {
  for_every_example([](const Material& material, const std::vector<double>& constants, const MaterialOptions& options) { check_history(material, constants, options); });
}

TEST_CASE("material: what a law remembers has names, units and shapes that fields can have") {
  const auto name_is_sound = [](std::string_view name) {
    return !name.empty() && std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
  };
  for (const Example& example : examples(Kind::material)) {
    INFO(label(example));
    const auto material = subject().registry.material(*values_of(example));
    for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
      const std::span<const StateVariable> state = material->state(space);
      const int symmetric = dimension(space) == 3 ? 6 : dimension(space) == 2 ? 4 : 3;
      for (std::size_t k = 0; k < state.size(); ++k) {
        const StateVariable& variable = state[k];
        CHECK_MESSAGE(name_is_sound(variable.name), "a variable is named '", variable.name, "': allowed are lower case letters, digits and underscores");
        CHECK_MESSAGE(!variable.unit.empty(), variable.name, " has no unit: \"-\" says that it has none");
        CHECK_MESSAGE((variable.components == 1 || variable.components == symmetric || variable.components == tensor_components(space)), variable.name, " has ", variable.components,
                      " components: a number has 1, a symmetric tensor ", symmetric, ", a tensor ", tensor_components(space));
        for (std::size_t other = 0; other < k; ++other) CHECK_MESSAGE(state[other].name != variable.name, "two variables are named ", variable.name);
      }
    }
  }
}

TEST_CASE("material: variables from outside have names and units, and are those of each point") {
  for_every_example([](const Material& material, const std::vector<double>& constants, const MaterialOptions& options) {
    const std::span<const ExternalVariable> variables = material.external();
    if (variables.empty()) return;
    INFO(options.law);
    Values reference, other;
    for (const ExternalVariable& variable : variables) {
      CHECK_MESSAGE((!variable.name.empty() && !variable.unit.empty() && std::isfinite(variable.reference)), "a variable from outside needs a name, a unit (\"-\") and a finite reference value");
      reference.push_back(variable.reference);
      other.push_back(1.1 * variable.reference + 0.1);
    }
    for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
      Random random(20);
      std::vector<Values> points, directions;
      for (int p = 0; p < 5; ++p) {
        points.push_back(random_direction(random, space));
        for (double& h : points.back()) h *= 0.02;
        directions.push_back(random_direction(random, space));
      }
      const auto evaluate = [&](const std::vector<Values>& outside) { return Evaluation(material, space, constants, points, directions, false, {}, false, 0, outside); };
      const Evaluation none = evaluate({}), given = evaluate({reference}), elsewhere = evaluate({other}), mixed = evaluate({reference, other, reference, other, other});
      for (int p = 0; p < 5; ++p) {
        CHECK_MESSAGE(given.all(p) == none.all(p), "the reference values are those that it has where none are given");
        CHECK_MESSAGE(mixed.all(p) == (p == 1 || p > 2 ? elsewhere : given).all(p), "each point has its own values, point ", p);
      }
      CHECK_MESSAGE(elsewhere.all(0) != given.all(0), "no variable from outside changes anything");
    }
  });
}

TEST_CASE("material: constants are complete, finite and repeatable, and the small-strain moduli are stable") {
  for (const Example& example : examples(Kind::material)) {
    INFO(label(example));
    const auto material = subject().registry.material(*values_of(example));
    const std::vector<double> constants = constants_of(*material, example);
    for (const double constant : constants) CHECK_MESSAGE(std::isfinite(constant), "a constant is not written or not finite");
    CHECK(constants == constants_of(*subject().registry.material(*values_of(example)), example));
    const Moduli moduli = material->small_strain(constants.data());
    CHECK_MESSAGE(moduli.mu > 0, "shear modulus at F = I: ", moduli.mu);
    CHECK_MESSAGE(moduli.bulk() > 0, "bulk modulus at F = I: ", moduli.bulk());
  }
}

TEST_CASE("material: the table declares a density, and what must be positive is refused when it is not") {
  for (const Example& example : examples(Kind::material)) {
    INFO(label(example));
    const ParameterTable& table = subject().registry.describe(Kind::material, example.part).parameters;
    const Parameter* density = table.find("density");
    REQUIRE_MESSAGE(density != nullptr, "no parameter 'density': the material cannot run in time");
    CHECK(density->unit == "kg/m^3");
    CHECK_THROWS_AS(parse_part(Kind::material, example.part, example.table + "\nno_such_parameter = 1.0", subject().registry), InputError);
    for (const std::string& key : values_of(example)->values.keys()) {
      const Parameter* parameter = table.find(key);
      if (!parameter->per_point || !(parameter->lower >= 0)) continue;
      std::string bad;
      bool written = false;   // else it has its default
      for (std::size_t begin = 0; begin < example.table.size();) {
        const std::size_t end = std::min(example.table.find('\n', begin), example.table.size());
        const std::string line = example.table.substr(begin, end - begin);
        const bool here = line.starts_with(key + " ") || line.starts_with(key + "=");
        bad += (here ? key + " = -1.0" : line) + "\n";
        written |= here;
        begin = end + 1;
      }
      if (!written) bad += key + " = -1.0\n";
      CHECK_THROWS_AS_MESSAGE(parse_part(Kind::material, example.part, bad, subject().registry), InputError, key, " = -1 is accepted");
    }
  }
}
