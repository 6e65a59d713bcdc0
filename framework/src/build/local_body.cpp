#include "build/local_body.hpp"

#include <algorithm>
#include <numeric>

#include "body/lattice_shares.hpp"
#include "build/scene_lattice.hpp"
#include "build/sets.hpp"
#include "build/size_check.hpp"
#include "perikit/build/body.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// As on one rank, where later regions take points from earlier ones; far points keep what they have.
void set_materials(const Scene& scene, const SetMembers& members, std::uint16_t far_material, Body& body) {
  std::vector<std::uint16_t> ids(body.material_ids().begin(), body.material_ids().end());
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    const std::string& set = scene.regions[r].set;
    for (const std::int32_t p : set == "all" ? std::vector(body.internal().begin(), body.internal().end()) : members.at(set))
      if (std::uint16_t& id = ids[static_cast<std::size_t>(p)]; id != far_material) id = static_cast<std::uint16_t>(r + 1);
  }
  body.set_materials(std::move(ids));
}

Inside inside_of(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  if (!description.inside) return {};
  return [&](const Point& x) { return (*description.inside)(x) != 0.0; };
}

}  // namespace

bool one_rank_holds(const Scene& scene) {
  if (!scene.body.lattice) return true;
  const double cells = estimated_cells(scene);
  try {
    check_index(scene, cells);
    if (!scene.body.lattice->inside)
      check_memory(scene, cells, scene_horizon(scene, scene.body.lattice->spacing) / scene.body.lattice->spacing, false);
  } catch (const InputError&) {
    return false;
  }
  return true;
}

int heaviest_rank(const Scene& scene, int ranks) {
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

std::optional<LocalBody> build_local_body(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material) {
  const LatticeDescription& description = *scene.body.lattice;
  check_volumes(scene);
  const double estimate = estimated_cells(scene), ratio = scene_horizon(scene, description.spacing) / description.spacing;
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside) check_memory(scene, estimate / communicator().size(), ratio, false, true);
  const Inside inside = inside_of(scene);
  std::vector<std::int64_t> points = points_in_tiles(lattice, inside);
  const std::int64_t all = std::accumulate(points.begin(), points.end(), std::int64_t{0});
  if (all == 0) refuse_empty_lattice(description);
  if (sparse(static_cast<double>(all), lattice)) return std::nullopt;
  const LatticeShares shares(lattice, std::move(points), communicator().size());
  check_memory(scene, static_cast<double>(shares.points()[static_cast<std::size_t>(communicator().rank())]), ratio, false, true);
  auto partition = std::make_unique<Partition>(scene_frame(scene, description.spacing), lattice, shares, inside, reach);
  Body body = partition->make_part(far_material);
  const SetMembers members = add_sets(scene.sets, body);
  set_materials(scene, members, far_material, body);
  return LocalBody{std::move(partition), std::move(body), lattice};
}

}  // namespace perikit
