#include "setup/body/body.hpp"

#include "setup/body/points_of_cloud.hpp"
#include "setup/body/scene_lattice.hpp"
#include "setup/body/sets.hpp"
#include "setup/body/size_check.hpp"

namespace perikit {

namespace {

Body cloud_body(const Scene& scene, const CloudPoints& cloud) {
  return Body(scene_frame(scene, cloud.spacing), cloud.points.position, cloud.points.volume);
}

Body lattice_body(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  const double spacing = description.spacing, ratio = scene_horizon(scene, spacing) / spacing, estimate = estimated_cells(scene);
  // What `inside` leaves is known after it was asked for every cell.
  check_index(scene, estimate);
  if (is_cloud(scene)) return cloud_body(scene, cloud_points(scene, WhichPoints::all));
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside) check_memory(scene, estimate, ratio, false);
  const std::array<std::int64_t, 3> cells = input_cells(lattice);
  std::vector<std::int32_t> kept;
  over_kept_cells(description, lattice, {0, cells[0] * cells[1] * cells[2]},
                  [&](std::int64_t index) { kept.push_back(static_cast<std::int32_t>(index)); });
  if (kept.empty()) refuse_empty_lattice(description);
  // So is a body that fills so little of its box that dead cells would dominate.
  if (sparse(static_cast<double>(kept.size()), lattice)) return cloud_body(scene, points_in_cells(scene, lattice, kept));
  check_memory(scene, static_cast<double>(lattice.cells), ratio, false);
  return Body(scene_frame(scene, spacing), lattice, std::move(kept));
}

}  // namespace

Body build_body(const Scene& scene) {
  check_volumes(scene);
  Body body = scene.body.lattice ? lattice_body(scene) : cloud_body(scene, cloud_points(scene, WhichPoints::all));
  add_sets(scene.sets, body);
  if (scene.regions.empty()) return body;
  std::vector<std::uint16_t> ids(body.stride(), 0);
  for (std::size_t r = 0; r < scene.regions.size(); ++r)
    for (const std::int32_t p : body.set(scene.regions[r].set))
      ids[static_cast<std::size_t>(p)] = static_cast<std::uint16_t>(r + 1);
  body.set_materials(std::move(ids));
  return body;
}

}  // namespace perikit
