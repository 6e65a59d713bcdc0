#include "setup/body/volumes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "body/voronoi/voronoi.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// Samples along an axis: 64 to 2744 a cell.
int samples(int dimension) {
  return dimension == 1 ? 64 : dimension == 2 ? 24 : 14;
}

/// visit(x) for the midpoints of n parts along each axis of a box with this half-width around a place.
template <class Visit>
void over_grid(const Point& centre, double half, int n, int dimension, Visit&& visit) {
  const auto at = [&](int k) { return half * ((2.0 * k + 1) / n - 1); };
  for (int k = 0; k < (dimension > 2 ? n : 1); ++k)
    for (int j = 0; j < (dimension > 1 ? n : 1); ++j)
      for (int i = 0; i < n; ++i) {
        Point x = centre;
        x[0] += at(i);
        if (dimension > 1) x[1] += at(j);
        if (dimension > 2) x[2] += at(k);
        visit(x);
      }
}

/// Twice the share of a sample: of one on the surface itself, where rounding would choose, half is inside. Its two sides are found a
/// millionth of the cell away, along a direction that no plane of a simple slope has.
int halves_inside(const Expression& inside, const Point& x, double cell, int dimension) {
  constexpr Point direction{1, 0.7390851332, 0.4142135624};
  Point above = x, below = x;
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) {
    above[c] += 1e-6 * cell * direction[c];
    below[c] -= 1e-6 * cell * direction[c];
  }
  return (inside(above) != 0) + (inside(below) != 0);
}

double squared_distance(const Point& a, const Point& b) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

/// Leaves of the cells of the first points what is inside. typical: reach of a cell.
void clip(std::span<const Point> points, int dimension, const Point& lower, const Point& upper, const Expression& inside,
          double typical, VoronoiCells& cells) {
  for (std::size_t n = 0; n < cells.size.size(); ++n) {
    // Cells all of whose surroundings are inside, on a coarse grid, are whole.
    bool whole = true;
    over_grid(points[n], 1.25 * cells.reach[n], 9, dimension, [&](Point x) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) x[c] = std::clamp(x[c], lower[c], upper[c]);
      whole = whole && inside(x) != 0;
    });
    if (whole) continue;
    const auto own = [&](const Point& x) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c)
        if (x[c] < lower[c] || x[c] > upper[c]) return false;
      const double distance = squared_distance(x, points[n]);
      return std::ranges::none_of(cells.neighbours[n], [&](std::int32_t j) { return squared_distance(x, points[static_cast<std::size_t>(j)]) < distance; });
    };
    const int along = 2 * samples(dimension);
    if (cells.reach[n] <= 1.5 * typical) {
      int all = 0, in = 0;
      over_grid(points[n], cells.reach[n], along, dimension, [&](const Point& x) {
        if (!own(x)) return;
        all += 2;
        in += halves_inside(inside, x, cells.reach[n], dimension);
      });
      if (all > 0) cells.size[n] *= static_cast<double>(in) / all;
      continue;
    }
    // The cell reaches far out of the body, as into a hole: the part inside is sought around the point, in boxes that grow until none of it
    // lies in their outer third.
    for (double half = 0.75 * typical;; half = std::min(1.5 * half, cells.reach[n])) {
      int in = 0;
      bool outer = false;
      over_grid(points[n], half, along, dimension, [&](const Point& x) {
        const int halves = halves_inside(inside, x, typical, dimension);
        if (halves == 0 || !own(x)) return;
        in += halves;
        for (std::size_t c = 0; c < 3; ++c) outer = outer || std::abs(x[c] - points[n][c]) > 2.0 / 3 * half;
      });
      cells.size[n] = 0.5 * in * std::pow(2 * half / along, dimension);
      if (!outer || half >= cells.reach[n]) break;
    }
  }
}

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return values.empty() ? 0 : *middle;
}

/// The same of all ranks, which must all call it. Positive numbers ascend as their bits do, of which one is found after the
/// other.
double middle_of_all(const std::vector<double>& values) {
  const std::int64_t before = counted(std::ssize(values)).all / 2;
  std::uint64_t found = 0;
  for (int bit = 62; bit >= 0; --bit) {
    const std::uint64_t tried = found | std::uint64_t{1} << bit;
    std::int64_t smaller =
        std::ranges::count_if(values, [&](double value) { return std::bit_cast<std::uint64_t>(value) < tried; });
    communicator().sum({&smaller, 1});
    if (smaller <= before) found = tried;
  }
  return std::bit_cast<double>(found);
}

/// Volumes of a rank's run of points, which other ranks have found. All ranks must call it.
std::vector<double> to_run(const SharedCells& found, std::size_t points) {
  struct Volume {
    std::int64_t number;
    double size;
  };
  const std::int64_t first = counted(static_cast<std::int64_t>(points)).before;
  const RunOwners runs(first);
  std::vector<std::vector<Volume>> to(static_cast<std::size_t>(communicator().size()));
  for (std::size_t n = 0; n < found.cells.size.size(); ++n)
    to[runs.owner(found.numbers[n])].push_back({found.numbers[n], found.cells.size[n]});
  std::vector<double> volumes(points);
  for (const std::vector<Volume>& of_rank : exchanged(to))
    for (const Volume& volume : of_rank) volumes[static_cast<std::size_t>(volume.number - first)] = volume.size;
  return volumes;
}

}  // namespace

PartOfCell part_inside(const Expression& inside, const Point& centre, double spacing, int dimension) {
  int all = 0, in = 0;
  over_grid(centre, 0.5 * spacing, samples(dimension), dimension, [&](const Point& x) {
    ++all;
    in += inside(x) != 0;
  });
  if (in == 0 || in == all) return {in > 0 ? 1.0 : 0.0, centre};
  int halves = 0;
  Point sum{};  // of twice the distances from the centre
  over_grid(centre, 0.5 * spacing, samples(dimension), dimension, [&](const Point& x) {
    const int own = halves_inside(inside, x, spacing, dimension);
    halves += own;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += own * (x[c] - centre[c]);
  });
  PartOfCell part{halves / (2.0 * all), centre};
  if (halves > 0)
    for (std::size_t c = 0; c < 3; ++c) part.centroid[c] += sum[c] / halves;
  return part;
}

std::vector<double> voronoi_volumes(const std::vector<Point>& points, int dimension, const Point& lower, const Point& upper,
                                    const Expression* inside, bool run) {
  if (run) {
    SharedCells found = shared_voronoi_cells(points, dimension, lower, upper, inside != nullptr);
    if (inside) clip(found.points, dimension, lower, upper, *inside, middle_of_all(found.cells.reach), found.cells);
    return to_run(found, points.size());
  }
  VoronoiCells cells = voronoi_cells(points, dimension, lower, upper, inside != nullptr);
  if (inside) clip(points, dimension, lower, upper, *inside, middle_of(cells.reach), cells);
  return cells.size;
}

}  // namespace perikit
