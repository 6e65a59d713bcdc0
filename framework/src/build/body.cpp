#include "perikit/build/body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "body/positions_file.hpp"
#include "build/held_surfaces.hpp"
#include "build/partial_cells.hpp"
#include "build/scene_lattice.hpp"
#include "build/sets.hpp"
#include "build/size_check.hpp"
#include "build/volumes.hpp"
#include "perikit/body/point_file.hpp"

namespace perikit {

namespace {

/// Uniform in [-1, 1), the same on every platform.
double centred(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0;
}

void check_cloud(const Scene& scene, std::size_t points, double ratio) {
  check_index(scene, static_cast<double>(points));
  check_horizon(scene, ratio);
  check_memory(scene, static_cast<double>(points), ratio, true);
}

/// Cells of the lattice along the axes of the input.
std::array<std::int64_t, 3> input_cells(const Lattice& lattice) {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  for (std::size_t k = 0; k < 3; ++k) cells[static_cast<std::size_t>(lattice.axis[k])] = lattice.extent[k];
  return cells;
}

/// Indices of the cells that the scene keeps, in input order: x fastest.
std::vector<std::int32_t> kept_cells(const LatticeDescription& description, const Lattice& lattice) {
  const std::array<std::int64_t, 3> cells = input_cells(lattice);
  std::vector<std::int32_t> kept;
  kept.reserve(static_cast<std::size_t>(cells[0] * cells[1] * cells[2]));
  std::array<std::int64_t, 3> k{};
  for (k[2] = 0; k[2] < cells[2]; ++k[2])
    for (k[1] = 0; k[1] < cells[1]; ++k[1])
      for (k[0] = 0; k[0] < cells[0]; ++k[0]) {
        std::array<std::int64_t, 3> inner{};
        for (std::size_t a = 0; a < 3; ++a) inner[a] = k[static_cast<std::size_t>(lattice.axis[a])];
        const std::int64_t index = lattice.index(inner[0], inner[1], inner[2]);
        if (description.inside && (*description.inside)(lattice.position(index)) == 0.0) continue;
        kept.push_back(static_cast<std::int32_t>(index));
      }
  return kept;
}

/// The cells as a cloud, moved at random by at most `jitter` spacings along each axis.
Body jittered(const Scene& scene, const Lattice& lattice, const std::vector<std::int32_t>& cells) {
  const LatticeDescription& description = *scene.body.lattice;
  std::mt19937_64 random(static_cast<std::uint64_t>(description.seed));
  std::vector<Point> positions;
  positions.reserve(cells.size());
  for (const std::int32_t index : cells) {
    Point x = lattice.position(index);
    for (int a = 0; a < scene.body.dimension && description.jitter > 0; ++a)
      x[static_cast<std::size_t>(a)] += description.jitter * description.spacing * centred(random);
    positions.push_back(x);
  }
  keep_off_surfaces(scene, description.spacing, positions);
  std::vector<double> volumes(positions.size(), std::pow(description.spacing, scene.body.dimension));
  if (scene.body.voronoi) {
    // The box of the cells that there are: jittered points may leave it by no more than half a spacing.
    Point lower = description.lower, upper = lattice.lower;
    const std::array<std::int64_t, 3> counts = input_cells(lattice);
    for (std::size_t c = 0; c < 3; ++c) upper[c] = description.lower[c] + static_cast<double>(counts[c]) * description.spacing;
    for (const Point& x : positions)
      for (std::size_t c = 0; c < 3; ++c) {
        lower[c] = std::min(lower[c], x[c]);
        upper[c] = std::max(upper[c], x[c]);
      }
    volumes = voronoi_volumes(positions, scene.body.dimension, lower, upper, description.inside ? &*description.inside : nullptr);
  }
  for (double& volume : volumes) volume *= scene.body.section;
  return Body(scene_frame(scene, description.spacing), positions, volumes);
}

/// The cells of a lattice that lie inside at least in part, as a cloud.
Body partial_cells(const Scene& scene, const Lattice& lattice) {
  const LatticeDescription& description = *scene.body.lattice;
  PartialCells cells = cells_inside(*description.inside, lattice, input_cells(lattice));
  if (cells.position.empty()) {
    throw InputError(
        description.position, "body.lattice.inside",
        "found an expression that keeps no cell of the lattice; allowed: one that is true in a part of one cell or more");
  }
  const double whole = std::pow(description.spacing, scene.body.dimension) * scene.body.section;
  for (double& volume : cells.volume) volume *= whole;
  keep_off_surfaces(scene, description.spacing, cells.position);
  return Body(scene_frame(scene, description.spacing), cells.position, cells.volume);
}

Body lattice_body(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  const double spacing = description.spacing, ratio = scene_horizon(scene, spacing) / spacing, estimate = estimated_cells(scene);
  // What `inside` leaves is known after it was asked for every cell.
  check_index(scene, estimate);
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside) check_memory(scene, estimate, ratio, description.jitter > 0);
  if (scene.partial_volume) {
    check_cloud(scene, static_cast<std::size_t>(estimate), ratio);
    return partial_cells(scene, lattice);
  }
  std::vector<std::int32_t> kept = kept_cells(description, lattice);
  if (kept.empty()) refuse_empty_lattice(description);
  // Jitter needs a cloud; so does a body that fills so little of its box that dead cells would dominate.
  if (description.jitter > 0 || sparse(static_cast<double>(kept.size()), lattice)) {
    check_cloud(scene, kept.size(), ratio);
    return jittered(scene, lattice, kept);
  }
  check_memory(scene, static_cast<double>(lattice.cells), ratio, false);
  return Body(scene_frame(scene, spacing), lattice, std::move(kept));
}

/// Points of a file with the volumes of their Voronoi cells.
PointCloud cells_of_points(const Scene& scene) {
  const BodyDescription& body = scene.body;
  PointCloud cloud = read_positions(*body.points_file, body.dimension);
  Point lower = cloud.position.front(), upper = lower;
  for (const Point& x : cloud.position)
    for (std::size_t c = 0; c < 3; ++c) {
      lower[c] = std::min(lower[c], x[c]);
      upper[c] = std::max(upper[c], x[c]);
    }
  const Point first = lower, last = upper;
  // The spacing that the points have in the box that is larger than they by half of it.
  double spacing = 0;
  for (int step = 0; step < 50; ++step) {
    double size = 1;
    for (std::size_t c = 0; c < static_cast<std::size_t>(body.dimension); ++c) size *= last[c] - first[c] + spacing;
    spacing = std::pow(size / static_cast<double>(cloud.position.size()), 1.0 / body.dimension);
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(body.dimension); ++c) {
    lower[c] = body.points_lower ? (*body.points_lower)[c] : lower[c] - 0.5 * spacing;
    upper[c] = body.points_upper ? (*body.points_upper)[c] : upper[c] + 0.5 * spacing;
    if (lower[c] > first[c] || upper[c] < last[c]) {
      throw InputError(body.volume_position, lower[c] > first[c] ? "body.points.lower" : "body.points.upper",
                       fmt::format("found {} along {}, with points from {} to {}; allowed: a box that holds all points",
                                   lower[c] > first[c] ? lower[c] : upper[c], "xyz"[c], first[c], last[c]));
    }
  }
  cloud.volume =
      voronoi_volumes(cloud.position, body.dimension, lower, upper, body.points_inside ? &*body.points_inside : nullptr);
  for (std::size_t n = 0; n < cloud.volume.size(); ++n) {
    if (cloud.volume[n] > 0) continue;
    const Point& x = cloud.position[n];
    throw InputError(
        body.volume_position, "body.points.inside",
        fmt::format(
            "found nothing inside around the point at ({:.6g}, {:.6g}, {:.6g}); allowed: points inside, at different places",
            x[0], x[1], x[2]));
  }
  for (double& volume : cloud.volume) volume *= body.section;
  return cloud;
}

Body file_body(const Scene& scene) {
  const PointCloud cloud =
      scene.body.voronoi ? cells_of_points(scene) : read_points(*scene.body.points_file, scene.body.dimension);
  double total = 0;
  for (const double v : cloud.volume) total += v;
  const double spacing =
      std::pow(total / scene.body.section / static_cast<double>(cloud.volume.size()), 1.0 / scene.body.dimension);
  const double reach = scene_horizon(scene, spacing);
  check_cloud(scene, cloud.volume.size(), reach / spacing);
  if (reach < spacing) {
    throw InputError(scene.body.position, "family.horizon",
                     fmt::format("found {}; allowed: at least the mean spacing of the points, {:.6g}", reach, spacing));
  }
  return Body(scene_frame(scene, spacing), cloud.position, cloud.volume);
}

}  // namespace

Body build_body(const Scene& scene) {
  check_volumes(scene);
  Body body = scene.body.lattice ? lattice_body(scene) : file_body(scene);
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
