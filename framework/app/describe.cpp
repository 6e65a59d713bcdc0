#include "describe.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "output_fields/state_field.hpp"
#include "scene/scene.hpp"
#include "study/study.hpp"

namespace perikit::app {

namespace {

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const Kind kind : all_kinds) names.emplace_back(name(kind));
  return names;
}

Kind parse_kind(const std::string& text) {
  if (const auto kind = kind_from_name(text)) return *kind;
  const auto names = kind_names();
  throw InputError(
      fmt::format("found the unknown kind '{}'; allowed: {}{}", text, fmt::join(names, ", "), did_you_mean(text, names)));
}

/// The header of the table that holds a part of this kind in a scene.
std::string scene_header(Kind kind) {
  switch (kind) {
    case Kind::influence: return "[family.influence]";
    case Kind::stabilization: return "[kinematics.stabilization]";
    case Kind::term: return "[[term]]";
    default: return fmt::format("[{}]", name(kind));
  }
}

void indent(std::string& out, const std::string& text) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    out += "  " + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
}

std::string parameter_lines(const ParameterTable& table) {
  std::string out;
  for (const Parameter& p : table.parameters()) {
    const std::string range = allowed(p);
    out += fmt::format("  {:<20} [{}] {}{}{}\n", p.name, p.unit.empty() ? "-" : p.unit, p.text,
                       p.required ? " Required." : p.default_text.empty() ? "" : fmt::format(" Default {}.", p.default_text),
                       range.empty() ? "" : fmt::format(" Allowed: {}.", range));
  }
  for (const ParameterGroup& g : table.groups()) out += "  " + group_line(g) + "\n";
  return out;
}

/// The keys of a file, or of one of its sections.
std::string describe_sections(const std::vector<std::pair<std::string, ParameterTable>>& sections, const std::string& section) {
  std::string out;
  std::vector<std::string> known;
  for (const auto& [name, table] : sections) {
    known.push_back(name.empty() ? "top" : name);
    if (section.empty() || section == known.back())
      out += fmt::format("[{}]\n{}{}\n", name.empty() ? "top level" : name, section_note(name), parameter_lines(table));
  }
  if (out.empty())
    throw InputError(fmt::format("found the unknown section '{}'; allowed: {}{}", section, fmt::join(known, ", "),
                                 did_you_mean(section, known)));
  return out;
}

/// For a name without its kind.
std::string kinds_with(Registry& registry, const std::string& part) {
  std::string meant;
  for (const Kind kind : all_kinds)
    if (registry.known(kind, part)) meant += fmt::format("{}{}/{}", meant.empty() ? "; did you mean " : ", ", name(kind), part);
  return meant;
}

}  // namespace

std::string group_line(const ParameterGroup& group) {
  return fmt::format("{} {} of: {}", group.count >= 0 ? "exactly" : "at most", std::abs(group.count), fmt::join(group.names, ", "));
}

std::string list_parts(Registry& registry, const std::string& kind) {
  std::string out;
  const std::vector<Kind> kinds = kind.empty() ? std::vector<Kind>(all_kinds.begin(), all_kinds.end()) : std::vector<Kind>{parse_kind(kind)};
  for (const Kind k : kinds) {
    const auto names = registry.names(k);
    if (kind.empty()) {
      if (names.empty()) continue;
      out += fmt::format("{}\n", name(k));
    }
    for (const std::string& part : names) {
      // A library may not be what its manifest says: the others are listed all the same.
      std::string summary;
      try {
        summary = registry.describe(k, part).summary;
      } catch (const InputError& error) {
        summary = fmt::format("cannot be opened: {}", error.what());
      }
      out += fmt::format("{}{:<24} {}\n", kind.empty() ? "  " : "", part, summary);
    }
  }
  return out;
}

std::string section_note(const std::string& section) {
  if (section == "constants") {
    return "Each key is a name of your own, its value a number, or an expression of numbers and other constants. Wherever a scene takes a number or an expression, it takes these names.\n\n"
           "```toml\n[constants]\nL = 0.2\nn = 40\ndx = \"L/n\"\n```\n\n";
  }
  if (section == "sets") {
    return "Each key is a name of your own for a set of points, which boundaries, loads, regions and the history use. Its value says which points these are, in one of three forms: "
           "an expression in x, y, z that is true at them; the one point nearest to a place; a list of indices. `all` is the set of all points.\n\n"
           "```toml\n[sets]\nleft = \"x < 0.01 && y > 0\"\ntip = { nearest = [0.2, 0] }\nmarks = { points = [3, 12, 40] }\n```\n\n";
  }
  if (section == "term") return "A list, `[[term]]`: each has the `type` of a part of the kind *term*, the keys of that part, and these.\n\n";
  return {};
}

std::vector<StateLine> states_of(Registry& registry, Kind kind, const PartDescription& part) {
  std::vector<StateLine> lines;
  if (kind != Kind::material || part.examples.empty()) return lines;
  try {
    const auto material = registry.material(*parse_part(kind, part.name, part.examples.front(), registry));
    for (const StateVariable& variable : material->state(Space::solid))
      lines.push_back({fmt::format("{}{}", state_prefix, variable.name), std::string(variable.unit), shape_of(variable, Space::solid)});
  } catch (const std::exception&) {
    lines.clear();   // an example that needs files: what it remembers is not known here
  }
  return lines;
}

std::string describe_part(Registry& registry, const std::string& part) {
  const std::size_t slash = part.find('/');
  const std::string head = part.substr(0, slash), rest = slash == std::string::npos ? "" : part.substr(slash + 1);
  if (head == "scene") return describe_sections(scene_sections(), rest);
  if (head == "study") return std::string(study_values_note) + "\n\n" + describe_sections(study_sections(), rest);
  if (slash == std::string::npos) {
    throw InputError(fmt::format("'{}': expected KIND/NAME, e.g. material/neo_hookean; scene or scene/SECTION, e.g. scene/output; or study{}", part,
                                 kinds_with(registry, part)));
  }
  const Kind kind = parse_kind(part.substr(0, slash));
  const PartDescription& d = registry.describe(kind, part.substr(slash + 1));
  std::string out = fmt::format("{}/{}: {}\n", name(kind), d.name, d.summary);
  const auto section = [&](const char* title, const std::string& text) {
    if (text.empty()) return;
    out += fmt::format("\n{}\n", title);
    indent(out, text);
  };
  section("Equations", d.equations);
  section("Source", d.source);
  section("Limits", d.limits);
  const std::vector<StateLine> states = states_of(registry, kind, d);
  if (!states.empty()) out += "\nStates (point fields)\n";
  for (const StateLine& state : states) out += fmt::format("  {:<28} [{}] {}\n", state.field, state.unit, state.shape);
  if (!d.parameters.parameters().empty()) out += "\nParameters\n";
  out += parameter_lines(d.parameters);
  out += "\nExample\n";
  for (const std::string& example : d.examples) {
    std::string table = fmt::format("{}\ntype = \"{}\"\n{}", scene_header(kind), d.name, example);
    indent(out, table);
  }
  return out;
}

}  // namespace perikit::app
