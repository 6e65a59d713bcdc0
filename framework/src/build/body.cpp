#include "perikit/build/body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "build/sets.hpp"
#include "build/size_check.hpp"
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

double horizon(const Scene& scene, double spacing) {
  return scene.horizon > 0 ? scene.horizon : scene.horizon_ratio * spacing;
}

BodyFrame frame(const Scene& scene, double spacing) {
  BodyFrame frame{scene.body.space, scene.body.section, spacing, horizon(scene, spacing), {}};
  for (const CrackDescription& crack : scene.cracks) frame.cracks.emplace_back(crack.vertices);
  return frame;
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
  const double volume = std::pow(description.spacing, scene.body.dimension) * scene.body.section;
  return Body(frame(scene, description.spacing), positions, std::vector<double>(positions.size(), volume));
}

Body lattice_body(const Scene& scene) {
  const LatticeDescription& description = *scene.body.lattice;
  const int d = scene.body.dimension;
  const double spacing = description.spacing, reach = horizon(scene, spacing), ratio = reach / spacing;
  double estimate = 1;
  for (int a = 0; a < d; ++a) estimate *= std::max(1.0, (description.upper[a] - description.lower[a]) / spacing + 1);
  // What `inside` leaves is known after it was asked for every cell.
  check_index(scene, estimate);
  check_horizon(scene, ratio);
  if (!description.inside) check_memory(scene, estimate, ratio, description.jitter > 0);
  const Lattice lattice = make_lattice(d, spacing, description.lower, description.upper, reach);
  const std::array<std::int64_t, 3> cells = input_cells(lattice);
  for (int a = 0; a < d; ++a) {
    if (cells[static_cast<std::size_t>(a)] >= 1) continue;
    throw InputError(
        description.position, "body.lattice",
        fmt::format("found no room for a point along {}; allowed: upper - lower of half a spacing or more", "xyz"[a]));
  }
  std::vector<std::int32_t> kept = kept_cells(description, lattice);
  if (kept.empty()) {
    throw InputError(description.position, "body.lattice.inside",
                     "found an expression that keeps no point of the lattice; allowed: one that is true at one point or more");
  }
  // Jitter needs a cloud; so does a body that fills so little of its box that dead cells would dominate.
  const bool sparse = static_cast<double>(kept.size()) < 0.08 * static_cast<double>(cells[0] * cells[1] * cells[2]);
  if (description.jitter > 0 || sparse) {
    check_cloud(scene, kept.size(), ratio);
    return jittered(scene, lattice, kept);
  }
  check_memory(scene, static_cast<double>(lattice.cells), ratio, false);
  return Body(frame(scene, spacing), lattice, std::move(kept));
}

Body file_body(const Scene& scene) {
  const PointCloud cloud = read_points(*scene.body.points_file, scene.body.dimension);
  double total = 0;
  for (const double v : cloud.volume) total += v;
  const double spacing =
      std::pow(total / scene.body.section / static_cast<double>(cloud.volume.size()), 1.0 / scene.body.dimension);
  const double reach = horizon(scene, spacing);
  check_cloud(scene, cloud.volume.size(), reach / spacing);
  if (reach < spacing) {
    throw InputError(scene.body.position, "family.horizon",
                     fmt::format("found {}; allowed: at least the mean spacing of the points, {:.6g}", reach, spacing));
  }
  return Body(frame(scene, spacing), cloud.position, cloud.volume);
}

}  // namespace

Body build_body(const Scene& scene) {
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
