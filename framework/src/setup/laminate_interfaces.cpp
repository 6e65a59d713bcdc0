#include "setup/laminate_interfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "body/family_limit.hpp"
#include "setup/materials.hpp"

namespace perikit {

namespace {

/// The same law with the same parameters; the density is no matter of it.
bool alike(const PartValues& a, const PartValues& b) {
  if (a.type != b.type) return false;
  const auto keys = [](const PartValues& part) {
    std::vector<std::string> keys = part.values.keys();
    std::erase(keys, "density");
    return keys;
  };
  const std::vector<std::string> of_a = keys(a);
  return of_a == keys(b) &&
         std::ranges::all_of(of_a, [&](const std::string& key) { return *a.values.find(key) == *b.values.find(key); });
}

bool varies(const PartValues& part, const Constants& constants) {
  return std::ranges::any_of(part.values.keys(), [&](const std::string& key) {
    const auto* const text = std::get_if<std::string>(part.values.find(key));
    return text && part.values.is_expression(key) &&
           Expression(*text, constants, false, part.values.position(key), part.values.path() + "." + key).depends_on_position();
  });
}

/// Why points of this material take their laws side by side; empty: they are laminates.
std::string obstacle(const Scene& scene, const PartFactory& factory, const PartValues& part, Space space) {
  const std::shared_ptr<const Material> material = factory.material(part);
  if (material->state_components(space) > 0) return fmt::format("\"{}\" has a history", part.type);
  if (!material->traits().hyperelastic) return fmt::format("\"{}\" is no derivative of an energy", part.type);
  if (!material->external().empty()) return fmt::format("\"{}\" reads variables from outside", part.type);
  // The other side of an interface may lie on another rank, and the number of ranks must change no bit.
  if (varies(part, scene.constants)) return fmt::format("\"{}\" varies in space", part.type);
  return {};
}

}  // namespace

std::vector<std::uint16_t> materials_of_points(const Body& body) {
  std::vector<std::uint16_t> material;
  const auto ids = body.material_ids();
  for (const std::int32_t p : body.internal())
    material.push_back(ids.empty() ? std::uint16_t{0} : ids[static_cast<std::size_t>(p)]);
  return material;
}

namespace {

void refuse_interfaces(const Scene& scene, const std::string& found, const std::string& allowed) {
  throw InputError(scene.laminates_position, "family.interfaces",
                   fmt::format("found \"{}\" {}; allowed: {}", *scene.laminates ? "laminate" : "parallel", found, allowed));
}

/// Whether there is anything to look for.
bool interfaces_wanted(const Scene& scene) {
  if (scene.laminates && scene.regions.empty()) refuse_interfaces(scene, "in a body of one material", "with a [[region]]");
  return !scene.regions.empty() && scene.laminates.value_or(true);
}

/// By material: the first one with the same law and parameters.
std::vector<std::uint16_t> first_alike(const Scene& scene) {
  const auto parts = materials(scene);
  std::vector<std::uint16_t> same(parts.size());
  for (std::size_t id = 0; id < parts.size(); ++id) {
    same[id] = static_cast<std::uint16_t>(id);
    for (std::size_t other = 0; other < id && same[id] == id; ++other)
      if (alike(*parts[id], *parts[other])) same[id] = static_cast<std::uint16_t>(other);
  }
  return same;
}

/// By input number: equal ones where laws and constants are equal, images as their sources.
void prepare_materials(const Scene& scene, std::span<const std::int32_t> sources, std::vector<std::uint16_t>& material, const Body& body) {
  const std::vector<std::uint16_t> same = first_alike(scene);
  material.resize(body.points() - sources.size());
  for (std::uint16_t& m : material) m = same[m];
  for (const std::int32_t source : sources) material.push_back(material[static_cast<std::size_t>(source)]);
}

/// How far interfaces are known [m]: stencils of bond gradients reach two families from their owner, which lies no farther from
/// the interface.
double reach_of_interfaces(const Body& body) {
  return 3 * search_radius(body.horizon());
}

/// Leaves out interfaces whose laws cannot make laminates.
void keep_laminates(const Scene& scene, const PartFactory& factory, const Formulation& formulation, Space space,
                    Interfaces& out) {
  if (formulation.pairs) return;
  const auto parts = materials(scene);
  for (std::size_t id = 0; id < parts.size(); ++id) {
    const std::string why = obstacle(scene, factory, *parts[id], space);
    if (why.empty()) continue;
    std::erase_if(out.all, [&](const Interface& of) { return of.first == id || of.second == id; });
    const std::size_t kept = std::erase_if(out.pairs, [&](const auto& of) { return of.first == id || of.second == id; });
    if (kept > 0) out.notes.push_back(why + ": each law by its share of the weight");
  }
}

}  // namespace

Interfaces build_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation, const Body& body,
                            std::vector<std::uint16_t> material, std::span<const std::int32_t> sources) {
  Interfaces out;
  if (!interfaces_wanted(scene)) return out;
  prepare_materials(scene, sources, material, body);
  out = find_interfaces(body, material, sources, reach_of_interfaces(body));
  keep_laminates(scene, factory, formulation, body.space(), out);
  return out;
}

}  // namespace perikit
