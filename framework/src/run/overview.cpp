// What `perikit check` shows of the body: its box, sets, materials, loads, and what was decided where the scene is silent.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "perikit/body/lattice.hpp"
#include "run/simulation.hpp"
#include "setup/conditions.hpp"

namespace perikit {

namespace {

using Vector = std::array<double, 3>;

std::string components(const Vector& v, int count) {
  std::string text;
  for (int a = 0; a < count; ++a) text += fmt::format("{}{:.5g}", a > 0 ? ", " : "", v[static_cast<std::size_t>(a)]);
  return count == 1 ? text : "(" + text + ")";
}

/// Of points: their number, volume, and the box that their centres span.
struct Extent {
  std::size_t points = 0;
  double volume = 0;
  Vector lower, upper;

  Extent(const Body& body, const std::vector<std::int32_t>& members) : points(members.size()) {
    lower.fill(std::numeric_limits<double>::infinity());
    upper.fill(-std::numeric_limits<double>::infinity());
    for (const std::int32_t index : members) {
      const auto p = static_cast<std::size_t>(index);
      const Point x = body.position(p);
      volume += body.volume(p);
      for (std::size_t a = 0; a < 3; ++a) lower[a] = std::min(lower[a], x[a]), upper[a] = std::max(upper[a], x[a]);
    }
  }
  std::string box(int dimension) const {
    std::string text;
    for (int a = 0; a < dimension; ++a) {
      const auto c = static_cast<std::size_t>(a);
      text += fmt::format("{}{} {:.6g} to {:.6g}", a > 0 ? ", " : "", "xyz"[c], lower[c], upper[c]);
    }
    return text;
  }
};

std::string of_box(const Body& body) {
  const Extent all(body, body.owned());
  return fmt::format("box           points at {} m; {:.6g} m^3\n", all.box(body.dimension()), all.volume);
}

std::string of_sets(const Scene& scene, const Body& body) {
  std::string text;
  for (const SetDescription& set : scene.sets) {
    const Extent extent(body, body.set(set.name));
    std::string line = fmt::format("set           {}: {} point{}", set.name, extent.points, extent.points == 1 ? "" : "s");
    if (set.nearest && extent.points == 1) {
      double squared = 0;
      for (std::size_t a = 0; a < static_cast<std::size_t>(body.dimension()); ++a) squared += std::pow(extent.lower[a] - (*set.nearest)[a], 2);
      line += fmt::format(" at {}, {:.3g} m from the place asked for", components(extent.lower, body.dimension()), std::sqrt(squared));
    } else {
      line += fmt::format(", {:.4g} m^3, at {}", extent.volume, extent.box(body.dimension()));
    }
    text += line + "\n";
  }
  return text;
}

/// Where no part of the scene gives a density there is no mass.
std::string of_masses(const Scene& scene, BodyProblem& problem) {
  const Body& body = problem.body();
  const auto name_of = [&](std::size_t id) { return id == 0 ? scene.material->type : fmt::format("{} (region.{}, set {})", scene.regions[id - 1].material->type, id - 1, scene.regions[id - 1].set); };
  std::map<std::size_t, std::pair<std::size_t, double>> by_material;
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    auto& [points, mass] = by_material[body.material_ids().empty() ? 0 : body.material_ids()[p]];
    ++points;
    mass += problem.laws().density(p) * body.volume(p);
  }
  std::string text;
  for (const auto& [id, of] : by_material) {
    if (id > scene.regions.size()) continue;
    text += fmt::format("material      {}: {} points{}\n", name_of(id), of.first, of.second > 0 ? fmt::format(", {:.6g} kg", of.second) : "");
  }
  return text;
}

/// The sum of all loads and their moment about the origin; loads of which one component alone varies are as good as others there.
std::string of_loads(const Scene& scene, BodyProblem& problem, double end) {
  if (scene.loads.empty()) return {};
  const Points& points = problem.points();
  const int d = points.dimension();
  Field force = problem.make_field();
  if (!problem.external_forces({problem.state().displacement(), end}, force).ok()) return {};
  Vector sum{}, moment{};
  double largest = 0;
  for (const std::int32_t index : points.owned()) {
    const Point x = points.position(static_cast<std::size_t>(index));
    Vector f{};
    for (int a = 0; a < d; ++a) f[static_cast<std::size_t>(a)] = force.component(a)[index];
    for (std::size_t a = 0; a < 3; ++a) {
      sum[a] += f[a];
      moment[a] += x[(a + 1) % 3] * f[(a + 2) % 3] - x[(a + 2) % 3] * f[(a + 1) % 3];
      largest += std::abs(f[a]);
    }
  }
  const double length = points.spacing() * std::cbrt(static_cast<double>(points.owned().size()));
  for (std::size_t a = 0; a < 3; ++a) {   // rounding of what cancels
    if (std::abs(sum[a]) < 1e-12 * largest) sum[a] = 0;
    if (std::abs(moment[a]) < 1e-12 * largest * length) moment[a] = 0;
  }
  std::string text = fmt::format("loads         together {} N at the end", components(sum, d));
  if (d == 2) text += fmt::format(", moment {:.5g} N m about the origin", moment[2]);
  if (d == 3) text += fmt::format(", moment {} N m about the origin", components(moment, 3));
  return text + "\n";
}

std::string of_conditions(const Scene& scene, const Body& body) {
  std::string text;
  for (std::size_t k = 0; k < scene.boundaries.size(); ++k) {
    const BoundaryDescription& boundary = scene.boundaries[k];
    std::string where = boundary.face.empty() ? boundary.surface ? "a surface" : fmt::format("set {}, {} points", boundary.set, body.set(boundary.set).size()) : "face " + boundary.face;
    std::string held;
    for (std::size_t a = 0; a < boundary.components.size(); ++a)
      if (boundary.components[a]) held += "xyz"[a];
    text += fmt::format("held          {} of {} by boundary.{} ({})\n", held.empty() ? "nothing" : held, where, k, boundary.velocity ? "velocity" : "displacement");
  }
  return text;
}

/// What the tables leave open and the set-up has decided.
std::string of_defaults(const Scene& scene) {
  std::string text;
  const auto decided = [&](const std::string& words) { text += fmt::format("{}{}", text.empty() ? "decided       " : ", ", words); };
  if (scene.damage && scene.damage->values.has("second_law") && !scene.damage->values.given("second_law"))
    decided(fmt::format("damage.second_law = {}", scene.damage->values.boolean("second_law")));
  if (!scene.consistent && scene.random_points()) decided("family.consistent = true where the kinematics can");
  return text.empty() ? text : text + "\n";
}

}  // namespace

std::string Simulation::overview() {
  const Body& body = problem_->body();
  return of_box(body) + of_sets(scene_, body) + of_masses(scene_, *problem_) + of_conditions(scene_, body) +
         of_loads(scene_, *problem_, end_of(scene_, traits_.quasi_static)) + of_defaults(scene_);
}

}  // namespace perikit
