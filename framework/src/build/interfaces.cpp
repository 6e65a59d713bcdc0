#include "build/interfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "body/lattice_shares.hpp"
#include "build/materials.hpp"
#include "build/sets.hpp"
#include "perikit/core/parallel.hpp"

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

/// How far interfaces are known [m]: stencils of bond gradients reach two families from their owner, which lies no farther from
/// the interface.
double reach_of_interfaces(const Body& body) {
  return 3 * body.horizon() * (1 + 1e-9);
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

/// Cells of a box of a lattice with a material each, or none.
class MaterialCells {
 public:
  static constexpr std::uint16_t none = 0xffff;
  MaterialCells(const CellBox& box) : box_(box), material_(static_cast<std::size_t>(box.cells()), none) {}
  std::uint16_t& at(const std::array<std::int64_t, 3>& k) noexcept { return material_[index(k)]; }

  /// By cell: whether different materials lie in the box of so many cells around it.
  std::vector<bool> meeting(std::int64_t by, int dimension) const {
    std::vector<std::uint16_t> least = material_, most(material_.size());
    std::ranges::transform(material_, most.begin(), [](std::uint16_t m) { return m == none ? std::uint16_t{0} : m; });
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension); ++axis) {
      least = spread(least, axis, by, [](std::uint16_t a, std::uint16_t b) { return std::min(a, b); });
      most = spread(most, axis, by, [](std::uint16_t a, std::uint16_t b) { return std::max(a, b); });
    }
    std::vector<bool> meet(material_.size());
    for (std::size_t n = 0; n < meet.size(); ++n) meet[n] = material_[n] != none && least[n] < most[n];
    return meet;
  }
  std::size_t index(const std::array<std::int64_t, 3>& k) const noexcept {
    return static_cast<std::size_t>(k[0] - box_.low[0] +
                                    box_.length(0) * (k[1] - box_.low[1] + box_.length(1) * (k[2] - box_.low[2])));
  }

 private:
  template <class Of>
  std::vector<std::uint16_t> spread(const std::vector<std::uint16_t>& from, std::size_t axis, std::int64_t by, Of&& of) const {
    std::vector<std::uint16_t> to = from;
    const std::int64_t step = axis == 0   ? 1
                              : axis == 1 ? box_.length(0)
                                          : box_.length(0) * box_.length(1),
                       length = box_.length(axis);
    parallel_for(from.size() / static_cast<std::size_t>(length), [&](std::size_t line) {
      const auto l = static_cast<std::int64_t>(line);
      const std::int64_t begin = l / step * step * length + l % step;
      for (std::int64_t k = 0; k < length; ++k)
        for (std::int64_t other = std::max<std::int64_t>(0, k - by); other <= std::min(length - 1, k + by); ++other) {
          std::uint16_t& value = to[static_cast<std::size_t>(begin + k * step)];
          value = of(value, from[static_cast<std::size_t>(begin + other * step)]);
        }
    });
    return to;
  }

  CellBox box_;
  std::vector<std::uint16_t> material_;
};

}  // namespace

Interfaces build_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation, const Body& body,
                            std::vector<std::uint16_t> material, std::span<const std::int32_t> sources) {
  Interfaces out;
  if (!interfaces_wanted(scene)) return out;
  const std::vector<std::uint16_t> same = first_alike(scene);
  for (std::uint16_t& m : material) m = same[m];
  for (const std::int32_t source : sources) material.push_back(material[static_cast<std::size_t>(source)]);
  out = find_interfaces(body, material, sources, reach_of_interfaces(body));
  keep_laminates(scene, factory, formulation, body.space(), out);
  return out;
}

Interfaces build_local_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation,
                                  const Body& part, const Lattice& whole) {
  Interfaces out;
  if (!interfaces_wanted(scene)) return out;
  const std::vector<std::uint16_t> same = first_alike(scene);
  const Expression* const inside = scene.body.lattice->inside ? &*scene.body.lattice->inside : nullptr;
  const auto material_at = [&](const Point& x) {
    std::size_t id = 0;  // the last region has the point
    for (std::size_t r = scene.regions.size(); r > 0 && id == 0; --r)
      if (const Expression* const set = set_expression(scene, scene.regions[r - 1].set); !set || (*set)(x) != 0.0) id = r;
    return same[id];
  };
  std::vector<std::uint16_t> material;
  for (const std::int32_t p : part.internal()) material.push_back(material_at(part.position(static_cast<std::size_t>(p))));
  const Lattice& lattice = *part.lattice();
  const double reach = reach_of_interfaces(part);
  const auto more = static_cast<std::int64_t>(std::ceil(surroundings(part, reach) / lattice.spacing));
  CellBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t by = a < static_cast<std::size_t>(part.dimension()) ? more : 0;
    box.low[a] = std::max<std::int64_t>(0, lattice.first[a] - by);
    box.high[a] = std::min(whole.extent[a], lattice.first[a] + lattice.extent[a] + by);
  }
  MaterialCells cells(box);
  in_input_order(whole, box, [&](const std::array<std::int64_t, 3>& k) {
    const Point x = whole.centre(k);
    if (!inside || (*inside)(x) != 0.0) cells.at(k) = material_at(x);
  });
  const auto bond = static_cast<std::int64_t>(std::floor(part.horizon() / lattice.spacing * (1 + 1e-9)));
  const std::vector<bool> meet = cells.meeting(bond, part.dimension());
  MeetingPoints meeting;
  in_input_order(whole, box, [&](const std::array<std::int64_t, 3>& k) {
    if (!meet[cells.index(k)]) return;
    const std::int64_t place = whole.index(k[0], k[1], k[2]);
    const std::int32_t p = part.at_place(place);
    meeting.place.push_back(place);
    meeting.material.push_back(cells.at(k));
    meeting.own.push_back(p >= 0 && part.owns(static_cast<std::size_t>(p)));
  });
  out = find_interfaces(part, whole, material, meeting, reach);
  keep_laminates(scene, factory, formulation, part.space(), out);
  return out;
}

}  // namespace perikit
