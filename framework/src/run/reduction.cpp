#include "run/reduction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "run/gathering.hpp"

namespace perikit {

namespace {

/// Of a point of a set. Place and volume are 0 where nobody asks for them.
struct Row {
  double value, x, y, z, volume;
};

bool takes_places(const std::string& reduce) { return reduce == "fit" || reduce == "error" || reduce == "extent" || reduce == "tip"; }

/// (y - about) x force, y being where the point is.
double moment_of(const HistoryDescription& record, BodyProblem& problem, std::size_t p, const double* force) {
  const ConstFieldView u = problem.state().displacement();
  Point arm = problem.points().position(p);
  for (std::size_t c = 0; c < 3; ++c) arm[c] += (static_cast<int>(c) < u.components ? u.component(static_cast<int>(c))[p] : 0.0) - record.about[c];
  const std::size_t axis = static_cast<std::size_t>(record.component[0] - 'x'), a = (axis + 1) % 3, b = (axis + 2) % 3;
  return arm[a] * force[b] - arm[b] * force[a];
}

/// What the points of the set that this rank has put in.
std::vector<double> values_of(const HistoryDescription& record, BodyProblem& problem, PointFields& fields, std::span<const std::int32_t> points) {
  const Body& body = problem.body();
  const OutputField field = fields.at(record.quantity, points);
  const auto width = static_cast<std::size_t>(field.width);
  const bool moment = record.reduce == "moment", area = record.reduce == "area", mass = record.reduce == "mass";
  const bool density = record.quantity != "reaction";   // a force over the volume of its point
  const Field* const couples = moment && !density ? &fields.reaction_couples() : nullptr;
  const double* const couple = couples ? couples->component(couples->components() == 3 ? record.component[0] - 'x' : 0) : nullptr;
  const int column = moment ? 0 : PointFields::column(field.width, record.component);
  std::vector<double> values;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const double* const row = &field.data[n * width];
    const auto p = static_cast<std::size_t>(points[n]);
    if (moment)
      values.push_back(moment_of(record, problem, p, row) * (density ? body.volume(p) : 1.0) + (couple ? couple[p] : 0.0));
    else if (area)
      values.push_back(fields.crack_areas().of(p));
    else if (mass)
      values.push_back(row[0] == static_cast<double>(record.piece) ? problem.masses().by_point()[p] : 0.0);
    else
      values.push_back(column >= 0 ? row[column] : std::sqrt(std::inner_product(row, row + width, row, 0.0)));
  }
  return values;
}

/// use(row) in the order of the set, on rank 0. All ranks must call it.
void over_rows(const HistoryDescription& record, BodyProblem& problem, PointFields& fields,
               const std::function<void(const Row&)>& use) {
  const Body& body = problem.body();
  const std::span<const std::int32_t> points = body.set(record.set);
  const bool places = takes_places(record.reduce);
  const std::size_t width = places ? 5 : 1;
  const std::vector<double> values = values_of(record, problem, fields, points);
  std::vector<double> mine;
  for (std::size_t n = 0; n < points.size(); ++n) {
    mine.push_back(values[n]);
    const auto p = static_cast<std::size_t>(points[n]);
    if (places) mine.insert(mine.end(), {body.position(p)[0], body.position(p)[1], body.position(p)[2], body.volume(p)});
  }
  gather_set(problem, record.set, mine, width, [&](std::span<const double> rows) {
    for (std::size_t n = 0; n < rows.size(); n += width)
      use(places ? Row{rows[n], rows[n + 1], rows[n + 2], rows[n + 3], rows[n + 4]} : Row{rows[n], 0, 0, 0, 0});
  });
}

double product(const std::vector<double>& u, const std::vector<double>& v) {
  return std::inner_product(u.begin(), u.end(), v.begin(), 0.0);
}

/// Turns three columns until they are orthogonal (one-sided Jacobi). Returns the rotation, by columns: turned column k is the sum over c of
/// rotation[k][c] times column c.
std::array<Point, 3> orthogonalized(std::array<std::vector<double>, 3>& x) {
  std::array<Point, 3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < 8; ++sweep) {   // each squares what is left of the cosines
    for (const auto& [i, j] : {std::pair{0u, 1u}, std::pair{0u, 2u}, std::pair{1u, 2u}}) {
      const double a = product(x[i], x[i]), b = product(x[j], x[j]), c = product(x[i], x[j]);
      if (c == 0) continue;
      const double ratio = (b - a) / (2 * c);
      const double tangent = std::copysign(1 / (std::abs(ratio) + std::hypot(1, ratio)), ratio);
      const double cosine = 1 / std::hypot(1, tangent), sine = cosine * tangent;
      const auto turn = [&](auto& u, auto& v) {
        for (std::size_t k = 0; k < u.size(); ++k)
          std::tie(u[k], v[k]) = std::pair(cosine * u[k] - sine * v[k], sine * u[k] + cosine * v[k]);
      };
      turn(x[i], x[j]);
      turn(rotation[i], rotation[j]);
    }
  }
  return rotation;
}

/// Whether points lie in a line or a plane across an axis as far as the place `along` is concerned: they have no extent along it, or one that is small
/// beside their largest and that a slope would be carried far beyond. Centroids of cut cells, a little off the line of the others, are such points: the
/// slope between them is noise. Extents are mean squares [m^2].
bool is_flat(double extent, double largest, double along) {
  constexpr double thin = 0.1, far = 4;   // relative to the largest extent, and to the extent itself
  if (extent <= 1e-18 * largest) return true;
  return extent < thin * thin * largest && along * along > far * far * extent;
}

double fitted(const Point& at, const std::vector<Row>& rows) {
  const double n = static_cast<double>(rows.size());
  const auto mean_of = [n](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / n; };
  std::array<std::vector<double>, 3> x;   // places, from their centre
  Point centre{};
  std::vector<double> off;  // values, from their mean
  for (const Row& row : rows) {
    const Point place{row.x, row.y, row.z};
    for (std::size_t c = 0; c < 3; ++c) x[c].push_back(place[c]);
    off.push_back(row.value);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    centre[c] = mean_of(x[c]);
    for (double& coordinate : x[c]) coordinate -= centre[c];
  }
  const std::array<Point, 3> axes = orthogonalized(x);
  const double mean = mean_of(off);
  for (double& value : off) value -= mean;
  const double largest = std::max({product(x[0], x[0]), product(x[1], x[1]), product(x[2], x[2])});
  double fit = mean;
  for (std::size_t k = 0; k < 3; ++k) {
    const double extent = product(x[k], x[k]);
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c) along += axes[k][c] * (at[c] - centre[c]);
    if (is_flat(extent / n, largest / n, along)) continue;   // the points have no slope along this axis
    fit += along * product(x[k], off) / extent;
  }
  return fit;
}

}  // namespace

double reduced(const HistoryDescription& record, BodyProblem& problem, PointFields& fields, double t) {
  double sum = 0, least = 0, largest = 0, count = 0, distance = 0, size = 0;
  std::vector<Row> all;
  const bool fit = record.reduce == "fit", error = record.reduce == "error", extent = record.reduce == "extent", tip = record.reduce == "tip";
  over_rows(record, problem, fields, [&](const Row& row) {
    if (fit) return all.push_back(row);  // the one that goes over them several times
    if ((extent || tip) && !(row.value > record.above)) return;
    const Point& n = record.direction;
    const double value = extent || tip ? n[0] * row.x + n[1] * row.y + n[2] * row.z : row.value;
    sum += value;
    if (count == 0 || value < least) least = value;
    if (count == 0 || largest < value) largest = value;
    ++count;
    if (!error) return;
    const double exact = (*record.exact)({row.x, row.y, row.z}, t), off = row.value - exact;
    distance += row.volume * off * off;
    size += row.volume * exact * exact;
  });
  if (communicator().rank() != 0) return 0;
  if (fit) return fitted(record.at, all);
  if (extent) return largest - least;
  if (tip) return count > 0 ? largest : std::numeric_limits<double>::quiet_NaN();
  if (record.reduce == "min") return least;
  if (record.reduce == "max") return largest;
  if (!error) return record.reduce == "mean" ? sum / count : sum;
  if (distance == 0) return 0;
  if (size > 0) return std::sqrt(distance / size);
  throw RunError(
      fmt::format("history column {}: `exact` is 0 at every point of \"{}\" at t = {:g}, and nothing to relate an error to",
                  record.name, record.set, t));
}

}  // namespace perikit
