#include "study/axes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "output/picture/gnuplot.hpp"

namespace perikit {

namespace {

std::string label(const Study& study, const std::string& column) {
  for (const StudyQuantity& quantity : study.quantities) {
    if (column == quantity.error_column()) return "relative error of " + quantity.name;
    if (column == quantity.name && quantity.from.ends_with("_time")) return quantity.name + " [s]";
    if (column == quantity.name && quantity.from == "memory") return quantity.name + " [bytes]";
  }
  return column;
}

std::string scale(const StudyTable& table, char axis, const std::string& column) {
  if (table.study.plot->log.find(axis) == std::string::npos) return "";
  double least = INFINITY, most = 0;
  for (const StudyRow& row : table.rows) {
    const auto value = table.number(row, column);
    if (!value || !(*value > 0) || !std::isfinite(*value)) continue;
    least = std::min(least, *value);
    most = std::max(most, *value);
  }
  std::string script = fmt::format("set logscale {}\n", axis);
  if (const auto tics = logarithmic_tics(least, most); !tics.empty()) script += fmt::format("set {}tics ({})\n", axis, fmt::join(tics, ", "));
  return script;
}

}  // namespace

std::vector<double> logarithmic_tics(double least, double most) {
  if (!(least > 0) || !(most > least) || most >= 100 * least) return {};
  std::vector<double> tics;
  // Round numbers: 1, 2, 5 of each decade, or, closer together, multiples of one step.
  if (most >= 5 * least) {
    for (int decade = static_cast<int>(std::floor(std::log10(least))) - 1; decade <= std::log10(most) + 1; ++decade)
      for (const double digit : {1.0, 2.0, 5.0}) tics.push_back(digit * std::pow(10.0, decade));
  } else {
    const double unit = std::pow(10.0, std::floor(std::log10((most - least) / 3)));
    double step = unit;
    for (const double digit : {2.0, 5.0, 10.0})
      if ((most - least) / step > 6) step = digit * unit;
    for (double k = std::floor(least / step) - 1; k * step <= most + step; ++k)
      if (k > 0) tics.push_back(k * step);
  }
  for (double& tic : tics) tic = std::stod(fmt::format("{:.12g}", tic));   // 0.3, not 0.30000000000000004
  return tics;
}

std::string axes(const StudyTable& table) {
  const StudyPlot& plot = *table.study.plot;
  return fmt::format("set title {}\nset xlabel {}\nset ylabel {}\nset autoscale fix\n{}{}", gnuplot_quoted(table.study.title),
                     gnuplot_quoted(label(table.study, plot.x)), gnuplot_quoted(label(table.study, plot.y)), scale(table, 'x', plot.x),
                     scale(table, 'y', plot.y));
}

}  // namespace perikit
