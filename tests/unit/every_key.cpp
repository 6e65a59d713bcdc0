// Every key of every section and every parameter of every part, spoilt in each way that its table allows for: each scene is
// refused with file, line, column, key, what was found and what is allowed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <map>

#include "tests/kit/registry.hpp"
#include "unit/scene_draft.hpp"
#include "unit/spoiled_values.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

// A scene with every section; what a file may be named for comes with the test.
const char* const sound = R"(format = 1
title = "everything"
[body]
dimension = 2
plane = "strain"
thickness = 1.0
[body.lattice]
spacing = 0.1
lower = [0, 0]
upper = [1, 1]
inside = "x > y"
jitter = 0.1
seed = 1
[sets]
left = "x < 0.1"
[sets.tip]
nearest = [1, 1]
[family]
horizon_ratio = 3
influence = "gaussian"
[kinematics]
type = "conventional"
stabilization = "silling"
[material]
type = "neo_hookean"
density = 1.0
shear_modulus = 1.0
bulk_modulus = 2.0
[[region]]
set = "left"
material = { type = "neo_hookean", shear_modulus = 1, bulk_modulus = 1 }
[damage]
type = "critical_stretch"
stretch = 0.1
no_fail = ["left"]
gradual = true
second_law = true
[[interface]]
between = ["left", "rest"]
damage = { type = "critical_stretch", stretch = 0.05 }
[[crack]]
segment = [[0, 0], [1, 1]]
[initial]
displacement = [0, 0]
velocity = [0, 0]
[[boundary]]
set = "left"
displacement = [0, "free"]
[[symmetry]]
axis = "x"
at = 0.0
[[periodic]]
axis = "y"
lower = 0.0
upper = 1.0
[[load]]
set = "left"
traction = [1, 0]
face = "-x"
[[term]]
type = "foundation"
set = "left"
stiffness = 1.0
[integrator]
type = "verlet"
end_time = 1.0
[output]
frames = 3
history_every = 1
checkpoint_every = 0
fields = ["displacement"]
[[output.history]]
name = "tip_x"
set = "tip"
quantity = "displacement"
component = "x"
reduce = "mean"
[run]
skip = true
share = true
threads = 1
seed = 1
)";

/// Lines of what the reader says.
std::vector<std::string> messages(const std::string& scene) {
  try {
    parse_scene(scene, "scene.toml", all_parts());
  } catch (const InputErrors& errors) {
    return errors.messages();
  } catch (const std::exception& error) {
    return {std::string("not an InputErrors: ") + error.what()};
  }
  return {};
}

class Refusals {
 public:
  /// One of the messages begins with the place and the key, and says what was found and what is allowed.
  void check(const SceneDraft& draft, const Place& at, const std::string& key, const std::string& hint = {}) {
    ++count;
    const std::string beginning = fmt::format("scene.toml:{}:{}: {}: found ", at.line, at.column, key);
    std::string all;
    for (const std::string& message : messages(draft.text())) {
      all += message + "\n";
      if (message.starts_with(beginning) && message.find("; allowed: ") != std::string::npos &&
          message.find(hint) != std::string::npos)
        return;
    }
    CAPTURE(draft.text());
    CHECK_MESSAGE(false, "expected ", beginning, "...; allowed: ... ", hint, ", got:\n", all);
  }

  /// Every way to spoil one parameter of a section. path: of the section in messages.
  void spoil(const SceneDraft& draft, const std::string& section, const std::string& path, const Parameter& p) {
    const std::string key = path.empty() ? p.name : path + "." + p.name;
    for (const SpoiledValue& bad : spoiled(p)) {
      SceneDraft changed = draft;
      Place at = changed.set(section, p.name, bad.value);
      if (!bad.fault.empty()) at.column += static_cast<int>(bad.value.rfind(bad.fault));
      check(changed, at, key + bad.key, bad.hint);
    }
    if (p.type == ParameterType::part) {
      const std::string name = all_parts().names(p.kind).back();
      SceneDraft changed = draft;
      check(changed, changed.set(section, p.name, quoted(misspelt(name))), key, "did you mean '" + name + "'");
    }
    if (p.required && !draft.get(section, p.name).empty()) {
      SceneDraft without = draft;
      without.remove(section, p.name);
      check(without, without.header(section), key, "found nothing");
    }
    SceneDraft renamed = draft;
    const std::string value = draft.get(section, p.name), wrong = misspelt(p.name);
    const Place at = renamed.set(section, p.name, value.empty() ? "1" : value, wrong);
    check(renamed, at, path.empty() ? wrong : path + "." + wrong, p.name.size() > 3 ? "did you mean '" + p.name + "'" : "");
  }

  int count = 0;
};

/// The section of a scene that holds a part, and its path in messages.
struct Slot {
  std::string section, path;
};
Slot slot_of(Kind kind) {
  if (kind == Kind::influence) return {"family.influence", "family.influence"};
  if (kind == Kind::stabilization) return {"kinematics.stabilization", "kinematics.stabilization"};
  if (kind == Kind::term) return {"term", "term.0"};
  return {std::string(name(kind)), std::string(name(kind))};
}

/// The sound scene with another part.
SceneDraft with_part(Kind kind, const PartDescription& part) {
  const Slot slot = slot_of(kind);
  std::string text = sound;
  if (kind == Kind::influence || kind == Kind::stabilization) {
    SceneDraft draft(text);
    draft.remove(kind == Kind::influence ? "family" : "kinematics", kind == Kind::influence ? "influence" : "stabilization");
    draft.append(fmt::format("[{}]\ntype = \"{}\"\n{}", slot.section, part.name, part.examples.front()));
    return draft;
  }
  const std::string header = kind == Kind::term ? "[[term]]\n" : fmt::format("[{}]\n", slot.section);
  const std::size_t begin = text.find(header), end = text.find("\n[", begin);
  text.replace(begin, end - begin, fmt::format("{}type = \"{}\"\n{}", header, part.name, part.examples.front()));
  if (kind == Kind::damage) {  // interfaces have the criterion of [damage]
    const std::size_t first = text.find("[[interface]]"), last = text.find("\n[", first) + 1;
    text.erase(first, last - first);
  }
  return SceneDraft(text);
}

}  // namespace

TEST_CASE("the scene that is spoilt key by key is sound, with every part in its place") {
  CHECK(messages(sound).empty());
  for (const Kind kind : all_kinds) {
    for (const std::string& name : all_parts().names(kind)) {
      INFO(perikit::name(kind), "/", name);
      const SceneDraft draft = with_part(kind, all_parts().describe(kind, name));
      const std::vector<std::string> all = messages(draft.text());
      CAPTURE(draft.text());
      CHECK_MESSAGE(all.empty(), all.front());
    }
  }
}

TEST_CASE("every key of every section of a scene, spoilt in every way, is refused with its place") {
  Refusals refusals;
  const SceneDraft draft{std::string(sound)};
  // As paths in messages; sets and lists of tables carry a name or a number.
  const std::map<std::string, std::string> sections{{"", ""},
                                                    {"body", "body"},
                                                    {"body.lattice", "body.lattice"},
                                                    {"sets.tip", "sets.tip"},
                                                    {"family", "family"},
                                                    {"kinematics", "kinematics"},
                                                    {"region", "region.0"},
                                                    {"damage", "damage"},
                                                    {"interface", "interface.0"},
                                                    {"crack", "crack.0"},
                                                    {"initial", "initial"},
                                                    {"boundary", "boundary.0"},
                                                    {"symmetry", "symmetry.0"},
                                                    {"periodic", "periodic.0"},
                                                    {"load", "load.0"},
                                                    {"term", "term.0"},
                                                    {"output", "output"},
                                                    {"output.history", "output.history.0"},
                                                    {"run", "run"}};
  for (const auto& [name, table] : scene_sections()) {
    const std::string section = name == "sets" ? "sets.tip" : name;
    if (!sections.contains(section)) {
      CHECK_MESSAGE((section == "constants" || section == "body.points"), "no test of section ", section);
      continue;
    }
    for (const Parameter& p : table.parameters()) {
      const bool own_section = section.empty() && p.type == ParameterType::part;
      const bool other_body = section == "body" && (p.name == "line" || p.name == "area");  // 1D
      const bool other_crack = section == "crack" && p.name == "polygon";                   // 3D
      if (!own_section && !other_body && !other_crack) refusals.spoil(draft, section, sections.at(section), p);
    }
  }
  MESSAGE(refusals.count, " scenes");
  CHECK(refusals.count > 250);
}

TEST_CASE("every parameter of every part, spoilt in every way, is refused with its place") {
  Refusals refusals;
  for (const Kind kind : all_kinds) {
    for (const std::string& name : all_parts().names(kind)) {
      const PartDescription& part = all_parts().describe(kind, name);
      const SceneDraft draft = with_part(kind, part);
      const Slot slot = slot_of(kind);
      for (const Parameter& p : part.parameters.parameters()) refusals.spoil(draft, slot.section, slot.path, p);
      SceneDraft renamed = draft;
      const Place at = renamed.set(slot.section, "type", quoted(misspelt(name)));
      refusals.check(renamed, at, slot.path + ".type", "did you mean '" + name + "'");
    }
  }
  MESSAGE(refusals.count, " scenes");
  CHECK(refusals.count > 500);
}
