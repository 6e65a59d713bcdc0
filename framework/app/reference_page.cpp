#include <fmt/format.h>
#include <fmt/ranges.h>

#include "describe.hpp"
#include "scene/scene.hpp"
#include "study/study.hpp"

namespace perikit::app {

namespace {

std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::string code(const std::string& text) { return text.empty() ? "" : fmt::format("`{}`", cell(text)); }

std::string table_of(const ParameterTable& table) {
  if (table.parameters().empty()) return "No keys of its own.\n";
  std::string out = "| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n";
  for (const Parameter& p : table.parameters()) {
    out += fmt::format("| {} | {} | {} | {} | {} |\n", code(p.name), p.unit.empty() ? "-" : cell(p.unit), p.required ? "required" : code(p.default_text),
                       cell(allowed(p)), cell(p.text));
  }
  for (const ParameterGroup& group : table.groups()) out += fmt::format("\nOf these, {}.\n", group_line(group));
  return out;
}

std::string fenced(const std::string& text, const std::string& language = {}) { return fmt::format("```{}\n{}\n```\n", language, text); }

std::string part_of(Registry& registry, Kind kind, const PartDescription& d) {
  std::string out = fmt::format("### {}/{}\n\n{}\n\n", name(kind), d.name, d.summary);
  if (!d.equations.empty()) out += fmt::format("{}\n", fenced(d.equations));
  if (!d.source.empty()) out += fmt::format("Source: {}\n\n", d.source);
  if (!d.limits.empty()) out += fmt::format("Limits: {}\n\n", d.limits);
  if (const std::vector<StateLine> states = states_of(registry, kind, d); !states.empty()) {
    std::vector<std::string> texts;
    for (const StateLine& state : states) texts.push_back(fmt::format("`{}` [{}], {}", state.field, state.unit, state.shape));
    out += fmt::format("Remembers, as point fields: {}.\n\n", fmt::join(texts, "; "));
  }
  out += table_of(d.parameters);
  for (const std::string& example : d.examples) {
    out += fmt::format("\n{}", fenced(fmt::format("{}\ntype = \"{}\"{}{}", kind == Kind::term ? "[[term]]" : fmt::format("[{}]", name(kind)), d.name, example.empty() ? "" : "\n", example), "toml"));
  }
  return out + "\n";
}

}  // namespace

std::string reference_page(Registry& registry) {
  std::string out = "# Reference\n\nWritten by `perikit describe --markdown` from the tables that the program reads its input with.\n\n"
                    "Wherever a number or an integer is allowed, so is a string with an expression of numbers and `[constants]`: `spacing = \"L/n\"`, `\"1/4\"` "
                    "([all about expressions](expressions.md)).\n\n## The scene\n\n";
  for (const auto& [section, table] : scene_sections()) {
    const std::string note = section_note(section);
    out += fmt::format("### {}\n\n{}", section.empty() ? "Top level" : fmt::format("[{}]", section), note);
    if (table.parameters().empty() && !note.empty()) continue;   // names of the user's own alone
    out += table_of(table) + "\n";
  }
  out += fmt::format("## A study\n\n{}\n\n", study_values_note);
  for (const auto& [section, table] : study_sections()) {
    out += fmt::format("### {}\n\n{}\n", section.empty() ? "Top level of a study" : fmt::format("[{}] of a study", section), table_of(table));
  }
  for (const Kind kind : all_kinds) {
    const auto names = registry.names(kind);
    if (names.empty()) continue;
    out += fmt::format("## Parts: {}\n\n", name(kind));
    for (const std::string& part : names) out += part_of(registry, kind, registry.describe(kind, part));
  }
  while (out.ends_with("\n\n")) out.pop_back();
  return out;
}

}  // namespace perikit::app
