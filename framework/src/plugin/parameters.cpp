#include "perikit/plugin/parameters.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace perikit {

namespace {

std::string range(const Parameter& p) {
  std::string text;
  if (std::isfinite(p.lower)) text = fmt::format(" {} {}", p.lower_open ? ">" : ">=", p.lower);
  if (std::isfinite(p.upper)) text += fmt::format("{} {} {}", text.empty() ? "" : " and", p.upper_open ? "<" : "<=", p.upper);
  return text;
}

std::string unit(const Parameter& p) {
  return p.unit.empty() || p.unit == "-" ? "" : fmt::format(" [{}]", p.unit);
}

std::string choices(const Parameter& p) {
  std::vector<std::string> all = p.choices;
  if (!p.choice_prefix.empty()) all.push_back(p.choice_prefix + "NAME");
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const char* separator = i == 0 ? "" : i + 1 == all.size() ? " or " : ", ";
    text += fmt::format("{}\"{}\"", separator, all[i]);
  }
  return text;
}

std::string length(const Parameter& p) {
  constexpr auto unbounded = std::numeric_limits<std::size_t>::max();
  if (p.per_axis && p.type != ParameterType::points) return "one for each dimension of the body";
  if (p.min_length == p.max_length) return fmt::format("exactly {}", p.min_length);
  if (p.max_length != unbounded) return fmt::format("{} to {}", p.min_length, p.max_length);
  return p.min_length > 0 ? fmt::format("at least {}", p.min_length) : "";
}

std::string list(const Parameter& p, const std::string& of) {
  const std::string count = length(p);
  return count.empty() ? "a list of " + of : fmt::format("a list of {} ({})", of, count);
}

}  // namespace

std::string_view name(Kind kind) noexcept {
  constexpr std::array<std::string_view, 7> names{"kinematics", "stabilization", "material", "damage", "influence", "term", "integrator"};
  return names[static_cast<std::size_t>(kind)];
}

std::optional<Kind> kind_from_name(std::string_view text) noexcept {
  const auto found = std::find_if(all_kinds.begin(), all_kinds.end(), [&](Kind kind) { return name(kind) == text; });
  return found == all_kinds.end() ? std::nullopt : std::optional(*found);
}

std::string allowed(const Parameter& p) {
  const std::string variables = p.time ? "x, y, z, t" : "x, y, z";
  switch (p.type) {
    case ParameterType::number:
      return "a number" + range(p) + unit(p);
    case ParameterType::integer:
      return "an integer" + range(p);
    case ParameterType::boolean:
      return "true or false";
    case ParameterType::text:
      return "a string";
    case ParameterType::choice:
      return choices(p);
    case ParameterType::expression:
      return fmt::format("a number{}{}, or an expression in {}", range(p), unit(p), variables);
    case ParameterType::component:
      return fmt::format("a number{}{}, an expression in {}, or \"free\"", range(p), unit(p), variables);
    case ParameterType::components:
      return fmt::format("a list, one for each dimension of the body, of numbers{}, expressions in {}, or \"free\"", unit(p),
                         variables);
    case ParameterType::expressions:
      return list(p, fmt::format("numbers{} or expressions in {}", unit(p), variables));
    case ParameterType::numbers:
      return list(p, "numbers" + range(p) + unit(p));
    case ParameterType::integers:
      return list(p, "integers" + range(p));
    case ParameterType::texts:
      return list(p, p.choices.empty() ? "strings" : choices(p));
    case ParameterType::points:
      return list(p, "points, each a list of coordinates" + unit(p));
    case ParameterType::part:
      return fmt::format("the name of {} {}, or a table {{ type = \"name\", ... }}",
                         p.kind == Kind::integrator || p.kind == Kind::influence ? "an" : "a", name(p.kind));
  }
  return {};
}

Parameter& ParameterTable::add(ParameterType type, std::string name, std::string unit, std::string text) {
  Parameter parameter;
  parameter.type = type;
  parameter.name = std::move(name);
  parameter.unit = std::move(unit);
  parameter.text = std::move(text);
  return parameters_.emplace_back(std::move(parameter));
}

Parameter& ParameterTable::number(std::string name, std::string unit, std::string text) {
  return add(ParameterType::number, std::move(name), std::move(unit), std::move(text));
}
Parameter& ParameterTable::integer(std::string name, std::string text) {
  return add(ParameterType::integer, std::move(name), "-", std::move(text));
}
Parameter& ParameterTable::boolean(std::string name, std::string text) {
  return add(ParameterType::boolean, std::move(name), "-", std::move(text));
}
Parameter& ParameterTable::string(std::string name, std::string text) {
  return add(ParameterType::text, std::move(name), "-", std::move(text));
}
Parameter& ParameterTable::choice(std::string name, std::vector<std::string> choices, std::string text) {
  Parameter& parameter = add(ParameterType::choice, std::move(name), "-", std::move(text));
  parameter.choices = std::move(choices);
  return parameter;
}
Parameter& ParameterTable::expression(std::string name, std::string unit, std::string text) {
  return add(ParameterType::expression, std::move(name), std::move(unit), std::move(text));
}
Parameter& ParameterTable::part(std::string name, Kind kind, std::string text) {
  Parameter& parameter = add(ParameterType::part, std::move(name), "-", std::move(text));
  parameter.kind = kind;
  return parameter;
}
Parameter& ParameterTable::material(std::string name, std::string unit, std::string text) {
  Parameter& parameter = expression(std::move(name), std::move(unit), std::move(text));
  parameter.per_point = true;
  return parameter;
}

ParameterTable& ParameterTable::exactly(int count, std::vector<std::string> names) {
  groups_.push_back({count, std::move(names)});
  return *this;
}
ParameterTable& ParameterTable::at_most_of(int count, std::vector<std::string> names) {
  groups_.push_back({-count, std::move(names)});
  return *this;
}

const Parameter* ParameterTable::find(std::string_view name) const noexcept {
  const auto found = std::find_if(parameters_.begin(), parameters_.end(), [&](const Parameter& p) { return p.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
}

ParameterTable elastic_parameters() {
  ParameterTable table;
  table.material("density", "kg/m^3", "Mass density; needed by dynamic integrators.").positive();
  table.material("youngs_modulus", "Pa", "Young's modulus E.").positive();
  table.material("poisson_ratio", "-", "Poisson's ratio nu.").above(-1.0).below(0.5);
  table.material("shear_modulus", "Pa", "Shear modulus G.").positive();
  table.material("bulk_modulus", "Pa", "Bulk modulus K.").positive();
  table.material("lame_lambda", "Pa", "First Lame constant lambda.");
  table.exactly(2, {"youngs_modulus", "poisson_ratio", "shear_modulus", "bulk_modulus", "lame_lambda"});
  return table;
}

ParameterTable rubber_parameters() {
  ParameterTable table = elastic_parameters();
  table.choice("volumetric", {"quadratic", "logarithmic"}, "Volumetric energy: kappa/2 (J-1)^2 or kappa/2 (ln J)^2.")
      .by_default("\"quadratic\"");
  return table;
}

}  // namespace perikit
