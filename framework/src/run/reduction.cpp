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

/// At this rank's points of a set, in its order.
std::vector<double> values_of(const HistoryDescription& record, const Body& body, PointFields& fields) {
  const int column = PointFields::column(record.quantity, record.component);
  const OutputField field = fields.at(record.quantity, body.set(record.set));
  const auto w = static_cast<std::size_t>(field.width);
  std::vector<double> values;
  for (const double* row = field.data.data(); row < field.data.data() + field.data.size(); row += w)
    values.push_back(column >= 0 ? row[column] : std::sqrt(std::inner_product(row, row + w, row, 0.0)));
  return values;
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

/// Of the points of a set, in its order: place and volume.
using Rows = std::vector<std::array<double, 4>>;

/// On rank 0 those of all ranks. All of them must call it.
Rows rows_of(const std::string& set, const BodyProblem& problem) {
  const Body& body = problem.body();
  std::vector<double> mine;
  for (const std::int32_t index : body.set(set)) {
    const auto p = static_cast<std::size_t>(index);
    const Point x = body.position(p);
    mine.insert(mine.end(), {x[0], x[1], x[2], body.volume(p)});
  }
  const std::vector<double> all = gather_set(problem, set, mine, 4);
  Rows rows(all.size() / 4);
  for (std::size_t n = 0; n < rows.size(); ++n) std::copy_n(&all[4 * n], 4, rows[n].begin());
  return rows;
}

double fitted(const HistoryDescription& record, const Rows& rows, const std::vector<double>& values) {
  const double n = static_cast<double>(rows.size());
  const auto mean_of = [n](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / n; };
  std::array<std::vector<double>, 3> x;   // places, from their centre
  Point centre{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (const auto& row : rows) x[c].push_back(row[c]);
    centre[c] = mean_of(x[c]);
    for (double& coordinate : x[c]) coordinate -= centre[c];
  }
  const std::array<Point, 3> axes = orthogonalized(x);
  const double mean = mean_of(values);
  std::vector<double> off = values;
  for (double& value : off) value -= mean;
  const double largest = std::max({product(x[0], x[0]), product(x[1], x[1]), product(x[2], x[2])});
  double fit = mean;
  for (std::size_t k = 0; k < 3; ++k) {
    const double extent = product(x[k], x[k]);
    if (extent <= 1e-18 * largest) continue;   // the points have no extent along this axis, and no slope
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c) along += axes[k][c] * (record.at[c] - centre[c]);
    fit += along * product(x[k], off) / extent;
  }
  return fit;
}

double error(const HistoryDescription& record, const Rows& rows, const std::vector<double>& values, double t) {
  double distance = 0, size = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double exact = (*record.exact)({rows[k][0], rows[k][1], rows[k][2]}, t), off = values[k] - exact, volume = rows[k][3];
    distance += volume * off * off;
    size += volume * exact * exact;
  }
  if (distance == 0) return 0;
  if (size > 0) return std::sqrt(distance / size);
  throw RunError(
      fmt::format("history column {}: `exact` is 0 at every point of \"{}\" at t = {:g}, and nothing to relate an error to",
                  record.name, record.set, t));
}

}  // namespace

double reduced(const HistoryDescription& record, const BodyProblem& problem, PointFields& fields, double t) {
  const std::vector<double> values = gather_set(problem, record.set, values_of(record, problem.body(), fields));
  const Rows rows = record.reduce == "fit" || record.reduce == "error" ? rows_of(record.set, problem) : Rows();
  if (values.empty()) return 0;  // rank 0 has them
  if (record.reduce == "fit") return fitted(record, rows, values);
  if (record.reduce == "error") return error(record, rows, values, t);
  if (record.reduce == "min") return *std::ranges::min_element(values);
  if (record.reduce == "max") return *std::ranges::max_element(values);
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return record.reduce == "sum" ? sum : sum / static_cast<double>(values.size());
}

}  // namespace perikit
