#include "plugin/registrar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <toml++/toml.h>

namespace perikit {

bool is_snake_case(std::string_view text) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !text.empty() && text.front() >= 'a' && text.front() <= 'z' && std::ranges::all_of(text, allowed) && text.back() != '_' &&
         text.find("__") == std::string_view::npos;
}

namespace {

/// What is wrong with a parameter table; empty when nothing is.
std::string fault(const ParameterTable& table) {
  std::set<std::string_view> names;
  for (const Parameter& parameter : table.parameters()) {
    if (parameter.name.empty()) return fmt::format("the parameter \"{}\" has no name: table.number(\"its_name\", ...)", parameter.text);
    if (parameter.name == "type") return "a parameter cannot be named 'type', which names the part";
    if (!names.insert(parameter.name).second) return fmt::format("parameter '{}' is declared twice", parameter.name);
  }
  for (const ParameterGroup& group : table.groups()) {
    for (const std::string& name : group.names) {
      if (!names.contains(name)) return fmt::format("a group names '{}', which is no parameter", name);
    }
  }
  return {};
}

/// What is wrong with an example, a TOML table without `type`; empty when nothing is.
std::string fault(const std::string& example) try {
  return toml::parse(example).contains("type") ? "an example must leave out 'type', which the part's name stands for" : "";
} catch (const toml::parse_error& error) {
  return fmt::format("example \"{}\" is not valid TOML: {}", example, error.description());
}

std::string fault(const PartDescription& description) {
  if (description.name.empty()) return "it has no name: {.name = \"its_name\", ...}";
  if (!is_snake_case(description.name)) return fmt::format("the name must be {}", snake_case_rule);
  if (description.summary.empty() || description.summary.find('\n') != std::string::npos) return "the summary must be one line of text";
  if (description.examples.empty()) return "at least one example is needed (\"\" where nothing is required)";
  for (const std::string& example : description.examples) {
    if (std::string reason = fault(example); !reason.empty()) return reason;
  }
  return fault(description.parameters);
}

}  // namespace

void PartCollector::add(RegisteredPart part) {
  const auto& description = part.description;   // no structured binding: clang 14 lets no lambda see one
  const auto& factory = part.factory;
  const auto refuse = [&](const std::string& reason) {
    throw std::invalid_argument(fmt::format("{} '{}': {}", name(part.kind()), description.name, reason));
  };
  if (const std::string reason = fault(description); !reason.empty()) refuse(reason);
  if (!std::visit([](const auto& f) { return static_cast<bool>(f); }, factory)) refuse("no factory");
  const auto same = [&](const auto& other) { return other->kind() == part.kind() && other->description.name == description.name; };
  if (std::ranges::any_of(parts, same)) refuse("registered twice");
  if (const auto owner = owner_(part.kind(), description.name); !owner.empty()) {
    refuse(fmt::format("duplicate: {} already brings it", owner.string()));
  }
  parts.push_back(std::make_shared<const RegisteredPart>(std::move(part)));
}

}  // namespace perikit
