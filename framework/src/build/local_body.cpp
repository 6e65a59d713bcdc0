#include "build/local_body.hpp"

#include <algorithm>
#include <numeric>

#include "body/cloud_shares.hpp"
#include "body/lattice_shares.hpp"
#include "body/streamed_cloud.hpp"
#include "build/cloud_points.hpp"
#include "build/scene_lattice.hpp"
#include "build/sets.hpp"
#include "build/size_check.hpp"
#include "perikit/build/body.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// By input number of the part: as on one rank, where later regions take points from earlier ones.
std::vector<std::uint16_t> materials_of_part(const Scene& scene, const SetMembers& members, const Body& body) {
  std::vector<std::uint16_t> material(body.points(), 0);
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    const auto id = static_cast<std::uint16_t>(r + 1);
    if (scene.regions[r].set == "all")
      std::ranges::fill(material, id);
    else
      for (const std::int32_t p : members.at(scene.regions[r].set))
        material[static_cast<std::size_t>(body.input_of(static_cast<std::size_t>(p)))] = id;
  }
  return material;
}

/// Far points keep what they have.
void set_materials(const std::vector<std::uint16_t>& material, std::uint16_t far_material, Body& body) {
  std::vector<std::uint16_t> ids(body.material_ids().begin(), body.material_ids().end());
  for (std::size_t n = 0; n < material.size(); ++n)
    if (std::uint16_t& id = ids[static_cast<std::size_t>(body.internal()[n])]; id != far_material) id = material[n];
  body.set_materials(std::move(ids));
}

Inside inside_of(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  if (!description.inside) return {};
  return [&](const Point& x) { return (*description.inside)(x) != 0.0; };
}

std::unique_ptr<Partition> part_of_cloud(const Scene& scene, const Partition::Reach& reach) {
  if (!communicator().complete()) {
    const CloudOutline cloud = cloud_outline(scene);
    const BodyFrame frame = scene_frame(scene, cloud.spacing);
    if (!lone_rank_orders(static_cast<double>(cloud.extent.points)))
      return std::make_unique<Partition>(frame, StreamedCloud(cloud.points, cloud.extent, frame.horizon), reach);
  }
  CloudPoints cloud = cloud_points(scene, WhichPoints::run);
  const BodyFrame frame = scene_frame(scene, cloud.spacing);
  return std::make_unique<Partition>(frame, SharedCloud(std::move(cloud.points), frame.horizon), reach);
}

std::unique_ptr<Partition> part_of_lattice(const Scene& scene, const Partition::Reach& reach) {
  const LatticeDescription& description = *scene.body.lattice;
  const double estimate = estimated_cells(scene), ratio = scene_horizon(scene, description.spacing) / description.spacing;
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside) check_memory(scene, estimate / communicator().size(), ratio, false, true);
  const Inside inside = inside_of(scene);
  std::vector<std::int64_t> points = points_in_tiles(lattice, inside);
  const std::int64_t all = std::accumulate(points.begin(), points.end(), std::int64_t{0});
  if (all == 0) refuse_empty_lattice(description);
  if (sparse(static_cast<double>(all), lattice)) return part_of_cloud(scene, reach);
  const LatticeShares shares(lattice, std::move(points), communicator().size());
  check_memory(scene, static_cast<double>(shares.points()[static_cast<std::size_t>(communicator().rank())]), ratio, false, true);
  return std::make_unique<Partition>(scene_frame(scene, description.spacing), lattice, shares, inside, reach);
}

}  // namespace

bool one_rank_holds(const Scene& scene) {
  const auto& lattice = scene.body.lattice;
  const double cells = lattice ? estimated_cells(scene) : 0;
  try {
    check_index(scene, cells);
    if (lattice && !lattice->inside)
      return likely_held(scene.body.dimension, cells, scene_horizon(scene, lattice->spacing) / lattice->spacing, is_cloud(scene));
    if (!is_cloud(scene) || scene.body.voronoi) return true;
    const CloudOutline cloud = cloud_outline(scene);
    return likely_held(scene.body.dimension, static_cast<double>(cloud.extent.points),
                       scene_horizon(scene, cloud.spacing) / cloud.spacing, true);
  } catch (const InputError&) {
    return false;
  }
}

int heaviest_rank(const Scene& scene, int ranks) {
  if (is_cloud(scene)) return ranks / 2;
  const Lattice lattice = scene_lattice(scene);
  const LatticeShares shares(lattice, points_in_tiles(lattice, inside_of(scene)), ranks);
  const auto halo = static_cast<std::int64_t>(2 * scene_horizon(scene, lattice.spacing) / lattice.spacing);
  int heaviest = 0;
  std::int64_t most = 0;
  for (int rank = 0; rank < ranks; ++rank) {
    CellBox box = shares.box(rank);
    for (std::size_t a = 0; a < static_cast<std::size_t>(lattice.dimension); ++a) {
      box.low[a] = std::max<std::int64_t>(0, box.low[a] - halo);
      box.high[a] = std::min(lattice.extent[a], box.high[a] + halo);
    }
    if (box.cells() > most) heaviest = rank, most = box.cells();
  }
  return heaviest;
}

LocalBody build_local_body(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material) {
  check_volumes(scene);
  std::unique_ptr<Partition> partition = is_cloud(scene) ? part_of_cloud(scene, reach) : part_of_lattice(scene, reach);
  Body body = partition->make_part(far_material);
  const SetMembers members = add_sets(scene.sets, body);
  std::vector<std::uint16_t> material = materials_of_part(scene, members, body);
  set_materials(material, far_material, body);
  return LocalBody{std::move(partition), std::move(body), std::move(material)};
}

}  // namespace perikit
