#include "setup/body/scene_lattice.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "setup/body/size_check.hpp"

namespace perikit {

void check_volumes(const Scene& scene) {
  const bool lattice = scene.body.lattice.has_value();
  if (scene.body.voronoi && lattice && scene.body.lattice->jitter == 0)
    throw InputError(scene.body.volume_position, "body.lattice.volume",
                     "found \"voronoi\" on a lattice; allowed: \"cell\", with family.partial_volume = true where `inside` cuts cells, or jitter > 0");
  if (!scene.partial_volume) return;
  const auto refuse = [&](const char* found, const char* allowed) {
    throw InputError(scene.partial_volume_position, "family.partial_volume",
                     fmt::format("found true {}; allowed: {}", found, allowed));
  };
  if (!lattice || scene.body.lattice->jitter > 0)
    refuse("on a cloud", "a lattice without jitter; clouds have volume = \"voronoi\"");
  if (!scene.body.lattice->inside) refuse("on a lattice that nothing cuts", "with body.lattice.inside");
}

double scene_horizon(const Scene& scene, double spacing) {
  return scene.horizon > 0 ? scene.horizon : scene.horizon_ratio * spacing;
}

BodyFrame scene_frame(const Scene& scene, double spacing) {
  // Shape tensors are volumes times squares of lengths: beyond, their squares are no numbers.
  constexpr double least = 1e-30, most = 1e30;
  if (!(spacing >= least && spacing <= most))
    throw InputError(scene.body.position, scene.body.lattice ? "body.lattice.spacing" : "body.points",
                     fmt::format("found points {:.6g} m apart; allowed: {} to {} m", spacing, least, most));
  BodyFrame frame{scene.body.space, scene.body.section, spacing, scene_horizon(scene, spacing), {}};
  for (const CrackDescription& crack : scene.cracks) frame.cracks.emplace_back(crack.vertices);
  return frame;
}

Lattice scene_lattice(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  const int d = scene.body.dimension;
  const double reach = scene_horizon(scene, description.spacing);
  check_horizon(scene, reach / description.spacing);
  for (int a = 0; a < d; ++a) {
    if (lattice_cells(description.lower[a], description.upper[a], description.spacing) >= 1) continue;
    throw InputError(
        description.position, "body.lattice",
        fmt::format("found no room for a point along {}; allowed: upper - lower of half a spacing or more", "xyz"[a]));
  }
  return make_lattice(d, description.spacing, description.lower, description.upper, reach);
}

Inside inside_of(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  if (!description.inside) return {};
  return [&](const Point& x) { return (*description.inside)(x) != 0.0; };
}

double estimated_cells(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  double cells = 1;
  for (int a = 0; a < scene.body.dimension; ++a)
    cells *= std::max(1.0, (description.upper[a] - description.lower[a]) / description.spacing + 1);
  return cells;
}

std::array<std::int64_t, 3> input_cells(const Lattice& lattice) {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  for (std::size_t k = 0; k < 3; ++k) cells[static_cast<std::size_t>(lattice.axis[k])] = lattice.extent[k];
  return cells;
}

void refuse_empty_lattice(const LatticeDescription& description) {
  throw InputError(description.position, "body.lattice.inside",
                   "found an expression that keeps no point of the lattice; allowed: one that is true at one point or more");
}

bool sparse(double points, const Lattice& lattice) {
  return points < 0.08 * (static_cast<double>(lattice.extent[0]) * static_cast<double>(lattice.extent[1]) *
                          static_cast<double>(lattice.extent[2]));
}

}  // namespace perikit
