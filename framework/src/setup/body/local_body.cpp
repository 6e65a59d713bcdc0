#include "setup/body/local_body.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "body/images/cloud_images.hpp"
#include "body/images/lattice_images.hpp"
#include "perikit/core/rank_values.hpp"
#include "setup/body/body.hpp"
#include "setup/body/points_of_cloud.hpp"
#include "setup/body/scene_lattice.hpp"
#include "setup/body/sets.hpp"
#include "setup/body/several_ranks.hpp"
#include "setup/body/size_check.hpp"
#include "setup/surfaces/image_planes.hpp"

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
void set_materials(const std::vector<std::uint16_t>& material, std::uint16_t far_material, std::uint16_t image_material, Body& body) {
  std::vector<std::uint16_t> ids(body.material_ids().begin(), body.material_ids().end());
  for (std::size_t n = 0; n < material.size(); ++n)
    if (const auto p = static_cast<std::size_t>(body.internal()[n]); ids[p] != far_material) ids[p] = body.image(p) ? image_material : material[n];
  body.set_materials(std::move(ids));
}

/// A part as it is placed, before anything is asked of its points.
struct LocalPlaces {
  std::unique_ptr<Partition> partition;
  Body body;
  std::optional<Images> images = std::nullopt;  ///< of bodies that have any, on whatever rank
  std::vector<FaceMotion> motions{};
  std::vector<std::string> notes{};
};

LocalPlaces placed(std::unique_ptr<Partition> partition, std::uint16_t far_material) {
  Body body = partition->make_part(far_material);
  return {std::move(partition), std::move(body)};
}

/// The planes and surfaces of a cloud, and what makes images behind them.
struct CloudPlanes {
  ScenePlanes scene;
  ImageMaker maker;
};

/// points: of this rank. The frame gets images of its cracks.
CloudPlanes planes_of_cloud(const Scene& scene, const PointStream& points, bool quasi_static, BodyFrame& frame) {
  ScenePlanes planes = build_planes(scene, placed_points(scene, frame, points), quasi_static);
  ImageMaker maker(frame, planes.planes, planes.surfaces);
  frame.cracks = maker.cracks(std::move(frame.cracks));
  return {std::move(planes), std::move(maker)};
}

LocalPlaces placed(const BodyFrame& frame, const CloudShares& shares, const Partition::Reach& reach, std::uint16_t far_material,
                   const CloudImages& images, CloudPlanes& planes) {
  LocalPlaces places = placed(std::make_unique<Partition>(frame, shares, reach, &images), far_material);
  places.images = images.of_part(places.body);
  places.motions = std::move(planes.scene.motions);
  places.notes = std::move(planes.scene.notes);
  return places;
}

/// A rank without others goes through the points of the cloud.
LocalPlaces place_stream(const Scene& scene, const CloudOutline& cloud, const Partition::Reach& reach, std::uint16_t far_material, bool quasi_static) {
  BodyFrame frame = scene_frame(scene, cloud.spacing);
  if (!has_images(scene))
    return placed(std::make_unique<Partition>(frame, StreamedCloud(cloud.points, cloud.extent, frame.horizon), reach), far_material);
  CloudPlanes planes = planes_of_cloud(scene, cloud.points, quasi_static, frame);
  const CloudImages images(planes.maker, cloud.extent.points, most_images(planes.maker, cloud.points), finder_of_stream(cloud.points));
  const PointStream all = images.with_images(cloud.points);
  return placed(frame, StreamedCloud(all, extent_of(all), frame.horizon), reach, far_material, images, planes);
}

LocalPlaces place_cloud(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material, bool quasi_static) {
  // Cells are found of all points that a rank without others has.
  if (!communicator().complete() && !scene.body.voronoi)
    if (const CloudOutline cloud = cloud_outline(scene); !lone_rank_orders(static_cast<double>(cloud.extent.points)))
      return place_stream(scene, cloud, reach, far_material, quasi_static);
  CloudPoints cloud = cloud_points(scene, WhichPoints::run);
  BodyFrame frame = scene_frame(scene, cloud.spacing);
  if (!has_images(scene))
    return placed(std::make_unique<Partition>(frame, SharedCloud(std::move(cloud.points), frame.horizon), reach), far_material);
  PointCloud& mine = cloud.points;
  const Counted points = counted(std::ssize(mine.position));
  const PointStream run = [&](const auto& visit) {
    for (std::size_t n = 0; n < mine.position.size(); ++n)
      visit({mine.position[n], mine.volume[n], points.before + static_cast<std::int64_t>(n)});
  };
  CloudPlanes planes = planes_of_cloud(scene, run, quasi_static, frame);
  CloudImages::Points with_images, made;
  const std::int64_t most = most_images(planes.maker, run, &with_images);
  const CloudImages images(planes.maker, points.all, most, finder_of_run(with_images, points.before));
  for (const CloudShares::OnePoint& point : with_images) images.add(point, made);
  std::vector<std::int64_t> numbers;
  for (const CloudShares::OnePoint& image : made) {
    mine.position.push_back(image.x);
    mine.volume.push_back(image.volume);
    numbers.push_back(image.number);
  }
  return placed(frame, SharedCloud(std::move(mine), frame.horizon, std::move(numbers)), reach, far_material, images, planes);
}

/// The numbers that points have in the input, in place of those of their cells; who owns them knows these.
void number_surfaces(const LatticeImages& of, const Lattice& lattice, const LatticeShares& shares, const Body& part, Images& images) {
  struct Surface {
    std::int64_t cell, number;
  };
  std::map<std::int64_t, std::int64_t> number_of;
  for (const ImageTerm& term : images.terms) number_of[term.surface] = -1;
  std::vector<std::vector<Surface>> asked(shares.boxes().size());
  for (const auto& [cell, number] : number_of)
    asked[static_cast<std::size_t>(shares.owner(of.grown_cell(cell)))].push_back({cell, number});
  std::vector<std::vector<Surface>> answers = exchanged(asked);
  for (std::vector<Surface>& of_rank : answers)
    for (Surface& surface : of_rank) {
      const std::array<std::int64_t, 3> k = of.grown_cell(surface.cell);
      if (const std::int32_t p = part.at_place(lattice.index(k[0], k[1], k[2])); p >= 0)
        surface.number = part.number(static_cast<std::size_t>(p));
    }
  for (const std::vector<Surface>& of_rank : exchanged(answers))
    for (const Surface& surface : of_rank) number_of[surface.cell] = surface.number;
  for (ImageTerm& term : images.terms) term.surface = number_of[term.surface];
}

/// What the memory of this machine must hold for a part of a lattice.
void check_part(const Scene& scene, const LatticeShares& shares) {
  const LatticeDescription& description = *scene.body.lattice;
  check_memory(scene, static_cast<double>(shares.points()[static_cast<std::size_t>(communicator().rank())]),
               scene_horizon(scene, description.spacing) / description.spacing, false, true);
}

/// With what lies beyond planes: of a lattice that has places for it, too.
LocalPlaces part_with_images(const Scene& scene, const Lattice& points, const Inside& inside, const Partition::Reach& reach,
                             std::uint16_t far_material, bool quasi_static) {
  ScenePlanes planes = build_planes(scene, placed_points(scene, points, inside), quasi_static);
  BodyFrame frame = scene_frame(scene, points.spacing);
  const Lattice lattice = with_images(points, frame.horizon, planes.planes);
  const LatticeImages images(points, lattice, inside, ImageMaker(points.dimension, halo(frame.horizon), planes.planes));
  frame.cracks = images.cracks(std::move(frame.cracks));
  const LatticeShares shares(lattice, points_in_tiles(lattice, images.box(), inside), communicator().size());
  check_part(scene, shares);
  const Inside real = [&](const Point& x) { return images.real(lattice.around(x)); };
  try {
    auto partition = std::make_unique<Partition>(frame, lattice, shares, real, reach, &images);
    Body body = partition->make_part(far_material);
    Images of_part = images.of_part(body);
    number_surfaces(images, lattice, shares, body, of_part);
    return {std::move(partition), std::move(body), std::move(of_part), std::move(planes.motions)};
  } catch (const OverlappingImage& error) {
    refuse_overlap(planes, error);
  }
}

LocalPlaces place_lattice(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material, bool quasi_static) {
  const LatticeDescription& description = *scene.body.lattice;
  const double estimate = estimated_cells(scene), ratio = scene_horizon(scene, description.spacing) / description.spacing;
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside) check_memory(scene, estimate / communicator().size(), ratio, false, true);
  const Inside inside = inside_of(scene);
  std::vector<std::int64_t> points = points_in_tiles(lattice, inside);
  const std::int64_t all = std::accumulate(points.begin(), points.end(), std::int64_t{0});
  if (all == 0) refuse_empty_lattice(description);
  if (sparse(static_cast<double>(all), lattice)) return place_cloud(scene, reach, far_material, quasi_static);
  if (has_images(scene)) return part_with_images(scene, lattice, inside, reach, far_material, quasi_static);
  const LatticeShares shares(lattice, std::move(points), communicator().size());
  check_part(scene, shares);
  return placed(std::make_unique<Partition>(scene_frame(scene, description.spacing), lattice, shares, inside, reach), far_material);
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

LocalBody build_local_body(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material, std::uint16_t image_material, bool quasi_static) {
  check_volumes(scene);
  LocalPlaces places = is_cloud(scene) ? place_cloud(scene, reach, far_material, quasi_static) : place_lattice(scene, reach, far_material, quasi_static);
  const SetMembers members = add_sets(scene.sets, places.body);
  std::vector<std::uint16_t> material = materials_of_part(scene, members, places.body);
  set_materials(material, far_material, image_material, places.body);
  return LocalBody{std::move(places.partition), std::move(places.body), std::move(material), std::move(places.images), std::move(places.motions), std::move(places.notes)};
}

}  // namespace perikit
