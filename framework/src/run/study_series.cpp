#include "run/study_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace perikit {

std::vector<StudySeries> plotted_series(const StudyTable& table) {
  const StudyPlot& plot = *table.study.plot;
  const auto drawable = [&](const std::optional<double>& value, char axis) {
    const bool logarithmic = plot.log.find(axis) != std::string::npos;
    return value && std::isfinite(*value) && (!logarithmic || *value > 0);
  };
  const auto& keys = table.study.keys;
  const auto series = static_cast<std::size_t>(std::ranges::find(keys, plot.series, &StudyKey::key) - keys.begin());
  std::vector<StudySeries> lines;
  for (const StudyRow& row : table.rows) {
    const auto x = table.number(row, plot.x), y = table.number(row, plot.y);
    if (!drawable(x, 'x') || !drawable(y, 'y')) continue;
    const std::string name = series < keys.size() ? row.values[series].shown : plot.y;
    auto line = std::ranges::find(lines, name, &StudySeries::name);
    if (line == lines.end()) line = lines.insert(lines.end(), StudySeries{name, {}});
    line->points.emplace_back(*x, *y);
  }
  return lines;
}

Crossing crossing(std::vector<std::pair<double, double>> points, double level, bool logarithmic) {
  std::ranges::sort(points);
  const auto above = std::find_if(points.rbegin(), points.rend(), [&](const auto& point) { return point.second > level; });
  if (above == points.rend()) return {points.front().first, Crossing::Kind::at_once};
  if (above == points.rbegin()) return {points.back().first, Crossing::Kind::never};
  const auto scaled = [&](double value) { return logarithmic ? std::log(value) : value; };
  const auto [x0, y0] = *above;
  const auto [x1, y1] = *std::prev(above);
  const double part = (scaled(level) - scaled(y0)) / (scaled(y1) - scaled(y0)), x = scaled(x0) + part * (scaled(x1) - scaled(x0));
  return {logarithmic ? std::exp(x) : x, Crossing::Kind::reached};
}

std::string level_table(const StudyTable& table) {
  const StudyPlot& plot = *table.study.plot;
  std::vector<std::pair<Crossing, std::string>> rows;
  for (const StudySeries& line : plotted_series(table))
    rows.emplace_back(crossing(line.points, *plot.level, plot.log == "xy"), line.name);
  const auto order = [](const auto& row) { return std::tuple(row.first.kind == Crossing::Kind::never, row.first.x); };
  std::ranges::stable_sort(rows, [&](const auto& a, const auto& b) { return order(a) < order(b); });
  std::string text = fmt::format("| {} | {} from which {} stays below {:g} |\n| --- | --- |\n",
                                 plot.series.empty() ? "series" : plot.series, plot.x, plot.y, *plot.level);
  for (const auto& [found, name] : rows) {
    constexpr std::array signs{"", "< ", "> "};
    text += fmt::format("| {} | {}{:.2g} |\n", name, signs[static_cast<std::size_t>(found.kind)], found.x);
  }
  return text;
}

}  // namespace perikit
