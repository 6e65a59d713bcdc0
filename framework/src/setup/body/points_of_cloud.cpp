#include "setup/body/points_of_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "body/partition/point_share.hpp"
#include "body/points/positions_file.hpp"
#include "perikit/core/rank_values.hpp"
#include "setup/body/partial_cells.hpp"
#include "setup/body/scene_lattice.hpp"
#include "setup/body/size_check.hpp"
#include "setup/body/volumes.hpp"
#include "setup/surfaces/held_surfaces.hpp"

namespace perikit {

namespace {

/// Uniform in [-1, 1), the same on every platform.
double centred(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0;
}

Run run_of(std::int64_t count, WhichPoints which) {
  return which == WhichPoints::all ? Run{0, count} : own_run(count);
}

Counted counted_of(std::size_t points, WhichPoints which) {
  const auto mine = static_cast<std::int64_t>(points);
  return which == WhichPoints::all ? Counted{0, mine} : counted(mine);
}

/// The mean spacing of a file's points.
double mean_spacing(const Scene& scene, double volume, double points) {
  return std::pow(volume / scene.body.section / points, 1.0 / scene.body.dimension);
}

/// points: of all ranks.
void check_cloud(const Scene& scene, double points, double ratio, WhichPoints which) {
  const bool part = which == WhichPoints::run;
  const double of_rank = part ? points / communicator().size() : points;
  check_index(scene, of_rank);
  check_horizon(scene, ratio);
  check_memory(scene, of_rank, ratio, true, part);
}

/// Whether points are shared out to ranks that are there.
bool shared(WhichPoints which) {
  return which == WhichPoints::run && communicator().complete() && communicator().size() > 1;
}

/// Makes a box as large as all points of it need, on whatever rank.
void extend(const std::vector<Point>& positions, WhichPoints which, Point& lower, Point& upper) {
  for (std::size_t c = 0; c < 3; ++c) {
    for (const Point& x : positions) {
      lower[c] = std::min(lower[c], x[c]);
      upper[c] = std::max(upper[c], x[c]);
    }
    if (!shared(which)) continue;
    lower[c] = -communicator().largest(-lower[c]);
    upper[c] = communicator().largest(upper[c]);
  }
}

/// Voronoi cells of the points.
std::vector<double> cells_of_jittered(const Scene& scene, const Lattice& lattice, const std::vector<Point>& positions,
                                      WhichPoints which) {
  const LatticeDescription& description = *scene.body.lattice;
  // The box of the cells that there are: jittered points may leave it by no more than half a spacing.
  Point lower = description.lower, upper = lattice.lower;
  const std::array<std::int64_t, 3> counts = input_cells(lattice);
  for (std::size_t c = 0; c < 3; ++c) upper[c] = description.lower[c] + static_cast<double>(counts[c]) * description.spacing;
  extend(positions, which, lower, upper);
  return voronoi_volumes(positions, scene.body.dimension, lower, upper, description.inside ? &*description.inside : nullptr,
                         shared(which));
}

/// One point in each of these cells, moved at random by at most `jitter` spacings along each axis; without volumes.
template <class Index>
PointCloud moved(const Scene& scene, const Lattice& lattice, std::span<const Index> kept, std::mt19937_64& random) {
  const LatticeDescription& description = *scene.body.lattice;
  PointCloud cloud;
  cloud.position.reserve(kept.size());
  for (const Index index : kept) {
    Point x = lattice.position(index);
    for (int a = 0; a < scene.body.dimension && description.jitter > 0; ++a)
      x[static_cast<std::size_t>(a)] += description.jitter * description.spacing * centred(random);
    cloud.position.push_back(x);
  }
  keep_off_surfaces(scene, description.spacing, cloud.position);
  return cloud;
}

double cell_volume(const Scene& scene) {
  return std::pow(scene.body.lattice->spacing, scene.body.dimension);
}

template <class Index>
PointCloud jittered(const Scene& scene, const Lattice& lattice, std::span<const Index> kept, WhichPoints which) {
  const LatticeDescription& description = *scene.body.lattice;
  const Counted points = counted_of(kept.size(), which);
  if (points.all == 0) refuse_empty_lattice(description);
  check_cloud(scene, static_cast<double>(points.all), scene_horizon(scene, description.spacing) / description.spacing, which);
  // Points draw one after the other, whichever ranks have them.
  std::mt19937_64 random(static_cast<std::uint64_t>(description.seed));
  if (description.jitter > 0)
    random.discard(static_cast<std::uint64_t>(points.before) * static_cast<std::uint64_t>(scene.body.dimension));
  PointCloud cloud = moved(scene, lattice, kept, random);
  cloud.volume = scene.body.voronoi ? cells_of_jittered(scene, lattice, cloud.position, which)
                                    : std::vector<double>(kept.size(), cell_volume(scene));
  for (double& volume : cloud.volume) volume *= scene.body.section;
  return cloud;
}

/// The cells that the scene keeps.
PointCloud points_of_cells(const Scene& scene, const Lattice& lattice, WhichPoints which) {
  const std::array<std::int64_t, 3> cells = input_cells(lattice);
  std::vector<std::int64_t> kept;
  over_kept_cells(*scene.body.lattice, lattice, run_of(cells[0] * cells[1] * cells[2], which),
                  [&](std::int64_t index) { kept.push_back(index); });
  return jittered<std::int64_t>(scene, lattice, kept, which);
}

PointCloud with_volumes(const Scene& scene, PartialCells cells) {
  for (double& volume : cells.volume) volume *= cell_volume(scene) * scene.body.section;
  keep_off_surfaces(scene, scene.body.lattice->spacing, cells.position);
  return {std::move(cells.position), std::move(cells.volume)};
}

/// The cells of a lattice that lie inside at least in part.
PointCloud partial_cells(const Scene& scene, const Lattice& lattice, WhichPoints which) {
  const LatticeDescription& description = *scene.body.lattice;
  check_cloud(scene, estimated_cells(scene), scene_horizon(scene, description.spacing) / description.spacing, which);
  const std::int64_t layers = input_cells(lattice)[static_cast<std::size_t>(scene.body.dimension - 1)];
  PartialCells cells = cells_inside(*description.inside, lattice, run_of(layers, which));
  if (counted_of(cells.position.size(), which).all == 0) {
    throw InputError(
        description.position, "body.lattice.inside",
        "found an expression that keeps no cell of the lattice; allowed: one that is true in a part of one cell or more");
  }
  return with_volumes(scene, std::move(cells));
}

CloudPoints points_of_lattice(const Scene& scene, WhichPoints which) {
  const LatticeDescription& description = *scene.body.lattice;
  const Lattice lattice = scene_lattice(scene);
  if (!description.inside)
    check_cloud(scene, estimated_cells(scene), scene_horizon(scene, description.spacing) / description.spacing, which);
  return {scene.partial_volume ? partial_cells(scene, lattice, which) : points_of_cells(scene, lattice, which),
          description.spacing};
}

void refuse_empty_cell(const Scene& scene, const PointCloud& cloud) {
  const auto empty = std::ranges::find_if_not(cloud.volume, [](double volume) { return volume > 0; });
  if (empty == cloud.volume.end()) return;
  const Point& x = cloud.position[static_cast<std::size_t>(empty - cloud.volume.begin())];
  throw InputError(
      scene.body.volume_position, "body.points.inside",
      fmt::format(
          "found nothing inside around the point at ({:.6g}, {:.6g}, {:.6g}); allowed: points inside, at different places", x[0],
          x[1], x[2]));
}

/// That of so many points in the box that is larger than they by half of it.
double spacing_in_box(const Point& first, const Point& last, double points, int dimension) {
  double spacing = 0;
  for (int step = 0; step < 50; ++step) {
    double size = 1;
    for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) size *= last[c] - first[c] + spacing;
    spacing = std::pow(size / points, 1.0 / dimension);
  }
  return spacing;
}

/// Volumes that are far larger than the room that there is for them, areas for instance, give a spacing and with it a horizon far beyond those of the
/// points: every point would be a neighbour of every other.
void check_volumes(const Scene& scene, const PointCloud& cloud, WhichPoints which, double total, double points, double ratio) {
  constexpr double most = 4;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Point lower{infinity, infinity, infinity}, upper{-infinity, -infinity, -infinity};
  extend(cloud.position, which, lower, upper);
  const int d = scene.body.dimension;
  const auto axes = static_cast<std::size_t>(d);
  for (std::size_t c = 0; c < axes; ++c)
    if (!(upper[c] > lower[c])) return;   // a layer may be as thick as it likes
  const double spacing = spacing_in_box(lower, upper, points, d), room = points * std::pow(spacing, d) * scene.body.section;
  if (points < 2 || total <= most * room) return;
  const double m = ratio * std::pow(total / room, 1.0 / d);
  throw InputError(scene.body.position, "body.points.file",
                   fmt::format("found volumes that add up to {:.4g} m^3, {:.3g} times the {:.4g} m^3 that the points have room for: their box is {:.4g} m long in x{}{}{}. With a horizon from "
                               "these volumes a family would have about {:.3g} points where {:.3g} are usual; allowed: volumes in m^3{}",
                               total, total / room, room, upper[0] - lower[0] + spacing, d > 1 ? fmt::format(", {:.4g} m in y", upper[1] - lower[1] + spacing) : "",
                               d > 2 ? fmt::format(", {:.4g} m in z", upper[2] - lower[2] + spacing) : "",
                               d < 3 ? fmt::format(", with a {} of {:.4g} m{}", d == 2 ? "thickness" : "section", scene.body.section, d == 1 ? "^2" : "") : "",
                               std::min(points, std::pow(2 * m + 1, d)), std::pow(2 * ratio + 1, d), d == 2 ? ", areas times the thickness" : ""));
}

/// Points of a file with the volumes of their Voronoi cells.
PointCloud cells_of_points(const Scene& scene, WhichPoints which) {
  const BodyDescription& body = scene.body;
  PointCloud cloud = which == WhichPoints::all ? read_positions(*body.points_file, body.dimension)
                                               : read_run_of_positions(*body.points_file, body.dimension);
  const auto points = static_cast<double>(counted_of(cloud.position.size(), which).all);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Point lower{infinity, infinity, infinity}, upper{-infinity, -infinity, -infinity};
  extend(cloud.position, which, lower, upper);
  const Point first = lower, last = upper;
  const double spacing = spacing_in_box(first, last, points, body.dimension);
  for (std::size_t c = 0; c < static_cast<std::size_t>(body.dimension); ++c) {
    lower[c] = body.points_lower ? (*body.points_lower)[c] : lower[c] - 0.5 * spacing;
    upper[c] = body.points_upper ? (*body.points_upper)[c] : upper[c] + 0.5 * spacing;
    if (lower[c] > first[c] || upper[c] < last[c]) {
      throw InputError(body.volume_position, lower[c] > first[c] ? "body.points.lower" : "body.points.upper",
                       fmt::format("found {} along {}, with points from {} to {}; allowed: a box that holds all points",
                                   lower[c] > first[c] ? lower[c] : upper[c], "xyz"[c], first[c], last[c]));
    }
  }
  cloud.volume = voronoi_volumes(cloud.position, body.dimension, lower, upper,
                                 body.points_inside ? &*body.points_inside : nullptr, shared(which));
  const auto check = [&] {
    refuse_empty_cell(scene, cloud);
    return true;
  };
  shared(which) ? agreed(check) : check();
  for (double& volume : cloud.volume) volume *= body.section;
  return cloud;
}

CloudPoints points_of_file(const Scene& scene, WhichPoints which) {
  const std::filesystem::path& file = *scene.body.points_file;
  const int dimension = scene.body.dimension;
  PointCloud cloud = scene.body.voronoi          ? cells_of_points(scene, which)
                     : which == WhichPoints::all ? read_points(file, dimension)
                                                 : read_run_of_points(file, dimension);
  ExactSum volumes;
  for (const double volume : cloud.volume) volumes.add(volume);
  const double total = which == WhichPoints::all ? volumes.value() : total_over_ranks(volumes),
               points = static_cast<double>(counted_of(cloud.volume.size(), which).all),
               spacing = mean_spacing(scene, total, points), reach = scene_horizon(scene, spacing);
  if (!scene.body.voronoi) check_volumes(scene, cloud, which, total, points, reach / spacing);
  check_cloud(scene, points, reach / spacing, which);
  if (reach < spacing) {
    throw InputError(scene.body.position, "family.horizon",
                     fmt::format("found {}; allowed: at least the mean spacing of the points, {:.6g}", reach, spacing));
  }
  return {std::move(cloud), spacing};
}

/// All points of a cloud in the order of the input, a piece at a time; as often as it is called.
using PieceStream = std::function<void(const std::function<void(const PointCloud&)>& use)>;

/// The scene must outlive it.
PieceStream piece_stream(const Scene& scene) {
  if (!scene.body.lattice)
    return [&scene](const auto& use) { over_points_of_file(*scene.body.points_file, scene.body.dimension, use); };
  return [&scene, lattice = scene_lattice(scene)](const auto& use) {
    const LatticeDescription& description = *scene.body.lattice;
    const std::array<std::int64_t, 3> cells = input_cells(lattice);
    std::mt19937_64 random(static_cast<std::uint64_t>(description.seed));
    const std::int64_t layers = cells[static_cast<std::size_t>(scene.body.dimension - 1)],
                       all = scene.partial_volume ? layers : cells[0] * cells[1] * cells[2],
                       piece = scene.partial_volume ? 8 : 1 << 16;
    std::vector<std::int64_t> kept;
    for (std::int64_t first = 0; first < all; first += piece) {
      const Run run{first, std::min(all, first + piece)};
      if (scene.partial_volume) {
        use(with_volumes(scene, cells_inside(*description.inside, lattice, run)));
        continue;
      }
      kept.clear();
      over_kept_cells(description, lattice, run, [&](std::int64_t index) { kept.push_back(index); });
      PointCloud cloud = moved<std::int64_t>(scene, lattice, kept, random);
      cloud.volume.assign(kept.size(), cell_volume(scene) * scene.body.section);
      use(cloud);
    }
  };
}

PointStream point_stream(const Scene& scene) {
  return [pieces = piece_stream(scene)](const auto& visit) {
    std::int64_t number = 0;
    pieces([&](const PointCloud& piece) {
      for (std::size_t n = 0; n < piece.position.size(); ++n) visit({piece.position[n], piece.volume[n], number++});
    });
  };
}

}  // namespace

CloudOutline cloud_outline(const Scene& scene) {
  const PointStream all = point_stream(scene);
  const CloudExtent extent = extent_of(all);
  if (extent.points == 0) refuse_empty_lattice(*scene.body.lattice);  // files refuse that themselves
  const auto points = static_cast<double>(extent.points);
  const double spacing = scene.body.lattice ? scene.body.lattice->spacing : mean_spacing(scene, extent.volume, points);
  check_cloud(scene, points, scene_horizon(scene, spacing) / spacing, WhichPoints::run);
  return {all, extent, spacing};
}

CloudPoints points_in_cells(const Scene& scene, const Lattice& lattice, std::span<const std::int32_t> cells) {
  return {jittered(scene, lattice, cells, WhichPoints::all), scene.body.lattice->spacing};
}

bool is_cloud(const Scene& scene) {
  return !scene.body.lattice || scene.body.lattice->jitter > 0 || scene.partial_volume;
}

CloudPoints cloud_points(const Scene& scene, WhichPoints which) {
  return scene.body.lattice ? points_of_lattice(scene, which) : points_of_file(scene, which);
}

}  // namespace perikit
