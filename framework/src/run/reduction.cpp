#include "run/reduction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
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

/// use(row) in the order of the set, on rank 0. All ranks must call it.
void over_rows(const HistoryDescription& record, const BodyProblem& problem, PointFields& fields,
               const std::function<void(const Row&)>& use) {
  const Body& body = problem.body();
  const std::span<const std::int32_t> points = body.set(record.set);
  const bool places = record.reduce == "fit" || record.reduce == "error";
  const std::size_t width = places ? 5 : 1;
  const int column = PointFields::column(record.quantity, record.component);
  const OutputField field = fields.at(record.quantity, points);
  const auto w = static_cast<std::size_t>(field.width);
  std::vector<double> mine;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const double* const row = &field.data[n * w];
    mine.push_back(column >= 0 ? row[column] : std::sqrt(std::inner_product(row, row + w, row, 0.0)));
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
    if (extent <= 1e-18 * largest) continue;   // the points have no extent along this axis, and no slope
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c) along += axes[k][c] * (at[c] - centre[c]);
    fit += along * product(x[k], off) / extent;
  }
  return fit;
}

}  // namespace

double reduced(const HistoryDescription& record, const BodyProblem& problem, PointFields& fields, double t) {
  double sum = 0, least = 0, largest = 0, count = 0, distance = 0, size = 0;
  std::vector<Row> all;
  const bool fit = record.reduce == "fit", error = record.reduce == "error";
  over_rows(record, problem, fields, [&](const Row& row) {
    if (fit) return all.push_back(row);  // the one that goes over them several times
    sum += row.value;
    if (count == 0 || row.value < least) least = row.value;
    if (count == 0 || largest < row.value) largest = row.value;
    ++count;
    if (!error) return;
    const double exact = (*record.exact)({row.x, row.y, row.z}, t), off = row.value - exact;
    distance += row.volume * off * off;
    size += row.volume * exact * exact;
  });
  if (communicator().rank() != 0) return 0;
  if (fit) return fitted(record.at, all);
  if (record.reduce == "min") return least;
  if (record.reduce == "max") return largest;
  if (!error) return record.reduce == "sum" ? sum : sum / count;
  if (distance == 0) return 0;
  if (size > 0) return std::sqrt(distance / size);
  throw RunError(
      fmt::format("history column {}: `exact` is 0 at every point of \"{}\" at t = {:g}, and nothing to relate an error to",
                  record.name, record.set, t));
}

}  // namespace perikit
