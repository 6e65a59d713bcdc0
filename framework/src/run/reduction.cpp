#include "run/reduction.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "perikit/run/point_fields.hpp"

namespace perikit {

namespace {

/// At the points of a set, in its order.
std::vector<double> values_of(const HistoryDescription& record, const Body& body, const OutputField& field) {
  const int column = PointFields::column(record.quantity, record.component);
  const auto w = static_cast<std::size_t>(field.width);
  std::vector<double> values;
  for (const std::int32_t p : body.set(record.set)) {
    const double* row = &field.data[w * static_cast<std::size_t>(body.input_of(static_cast<std::size_t>(p)))];
    values.push_back(column >= 0 ? row[column] : std::sqrt(std::inner_product(row, row + w, row, 0.0)));
  }
  return values;
}

double fitted(const HistoryDescription& record, const Body& body, const std::vector<double>& values) {
  const auto& members = body.set(record.set);
  const auto n = static_cast<Eigen::Index>(members.size());
  Eigen::MatrixX3d x(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Point place = body.position(static_cast<std::size_t>(members[static_cast<std::size_t>(k)]));
    x.row(k) << place[0], place[1], place[2];
  }
  const Eigen::RowVector3d centre = x.colwise().mean();
  x.rowwise() -= centre;
  const Eigen::Map<const Eigen::VectorXd> v(values.data(), n);
  const double mean = v.mean();
  // The least-norm solution has no slope where the points have no extent; the threshold is relative to the largest extent.
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixX3d> extent(x);
  extent.setThreshold(1e-9);
  const Eigen::Vector3d slope = extent.solve((v.array() - mean).matrix());
  return mean + (Eigen::RowVector3d(record.at[0], record.at[1], record.at[2]) - centre).dot(slope.transpose());
}

double error(const HistoryDescription& record, const Body& body, const std::vector<double>& values, double t) {
  const auto& members = body.set(record.set);
  double distance = 0, size = 0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const auto p = static_cast<std::size_t>(members[k]);
    const double exact = (*record.exact)(body.position(p), t), off = values[k] - exact;
    distance += body.volume(p) * off * off;
    size += body.volume(p) * exact * exact;
  }
  if (distance == 0) return 0;
  if (size > 0) return std::sqrt(distance / size);
  throw RunError(
      fmt::format("history column {}: `exact` is 0 at every point of \"{}\" at t = {:g}, and nothing to relate an error to",
                  record.name, record.set, t));
}

}  // namespace

double reduced(const HistoryDescription& record, const Body& body, const OutputField& field, double t) {
  const std::vector<double> values = values_of(record, body, field);
  if (record.reduce == "fit") return fitted(record, body, values);
  if (record.reduce == "error") return error(record, body, values, t);
  if (record.reduce == "min") return *std::ranges::min_element(values);
  if (record.reduce == "max") return *std::ranges::max_element(values);
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return record.reduce == "sum" ? sum : sum / static_cast<double>(values.size());
}

}  // namespace perikit
