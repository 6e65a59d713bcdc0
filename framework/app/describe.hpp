#pragma once
#include <string>
#include <vector>

#include "plugin/registry.hpp"

namespace perikit::app {

/// Known parts by kind, one line each. kind empty: all. Throws InputError for an unknown kind.
std::string list_parts(Registry& registry, const std::string& kind);

inline constexpr const char* study_values_note =
    "A study runs one scene for lists of values of some of its keys: `[values]` holds these keys, e.g. `family.horizon_ratio = [2.015, 3.015]`. "
    "`perikit study` writes table.csv, table.md and, with [plot], plot.png and plot.svg.";

/// What the tables do not say of a section whose keys are names of the user's own: [constants], [sets]. Markdown; empty for other sections.
std::string section_note(const std::string& section);

/// Everything that the part's tables say. `part`: KIND/NAME; or "scene", "scene/SECTION", "study", "study/SECTION" for the keys of these files.
std::string describe_part(Registry& registry, const std::string& part);

/// One a variable that a material remembers, as its example has them: name of the field, unit, shape. Empty for other kinds.
struct StateLine {
  std::string field, unit, shape;
};
std::vector<StateLine> states_of(Registry& registry, Kind kind, const PartDescription& part);

/// "exactly 2 of: youngs_modulus, ..."
std::string group_line(const ParameterGroup& group);

/// The keys of the scene and everything about every known part, as one Markdown page.
std::string reference_page(Registry& registry);

}  // namespace perikit::app
