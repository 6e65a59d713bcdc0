#include "study/series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace perikit {

std::vector<std::size_t> keys_of_series(const StudyTable& table) {
  const StudyPlot& plot = *table.study.plot;
  const auto& keys = table.study.keys;
  const bool over_a_key = std::ranges::find(keys, plot.x, &StudyKey::key) != keys.end();
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const bool named = std::ranges::find(plot.series, keys[k].key) != plot.series.end();
    const bool needed = over_a_key && !table.study.zip && keys[k].key != plot.x && keys[k].values.size() > 1;
    if (named || needed) found.push_back(k);
  }
  return found;
}

std::vector<StudySeries> plotted_series(const StudyTable& table) {
  const StudyPlot& plot = *table.study.plot;
  const auto drawable = [&](const std::optional<double>& value, char axis) {
    const bool logarithmic = plot.log.find(axis) != std::string::npos;
    return value && std::isfinite(*value) && (!logarithmic || *value > 0);
  };
  const std::vector<std::size_t> keys = keys_of_series(table);
  std::vector<StudySeries> lines;
  for (const StudyRow& row : table.rows) {
    std::string name = keys.empty() ? plot.y : "";
    for (const std::size_t k : keys) name += (name.empty() ? "" : ", ") + row.values[k].shown;
    auto line = std::ranges::find(lines, name, &StudySeries::name);
    if (line == lines.end()) line = lines.insert(lines.end(), StudySeries{name, {}, {}});
    const auto x = table.number(row, plot.x), y = table.number(row, plot.y);
    if (drawable(x, 'x') && drawable(y, 'y'))
      line->points.emplace_back(*x, *y);
    else
      ++line->missing[row.status == "done" ? "without numbers" : row.status];
  }
  return lines;
}

std::string series_title(const StudyTable& table) {
  std::string title;
  for (const std::size_t k : keys_of_series(table)) title += (title.empty() ? "" : ", ") + table.study.keys[k].key;
  return title;
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
    if (!line.points.empty()) rows.emplace_back(crossing(line.points, *plot.level, plot.log == "xy"), line.name);
  const auto order = [](const auto& row) { return std::tuple(row.first.kind == Crossing::Kind::never, row.first.x); };
  std::ranges::stable_sort(rows, [&](const auto& a, const auto& b) { return order(a) < order(b); });
  std::string text = fmt::format("| {} | {} from which {} stays below {:g} |\n| --- | --- |\n",
                                 series_title(table).empty() ? "series" : series_title(table), plot.x, plot.y, *plot.level);
  for (const auto& [found, name] : rows) {
    constexpr std::array signs{"", "< ", "> "};
    text += fmt::format("| {} | {}{:.2g} |\n", name, signs[static_cast<std::size_t>(found.kind)], found.x);
  }
  return text;
}

namespace {

bool positive(const std::optional<double>& value) {
  return value && std::isfinite(*value) && *value > 0;
}

/// Rows of the table in groups that differ in this key alone, each group by ascending value.
std::vector<std::vector<const StudyRow*>> along(const StudyTable& table, std::size_t key) {
  std::vector<std::vector<const StudyRow*>> groups;
  for (const StudyRow& row : table.rows) {
    if (!positive(row.values[key].number)) continue;
    const auto same = [&](const auto& group) {
      for (std::size_t k = 0; k < row.values.size(); ++k)
        if (k != key && row.values[k].toml != group.front()->values[k].toml) return false;
      return true;
    };
    const auto group = std::ranges::find_if(groups, same);
    if (group == groups.end())
      groups.push_back({&row});
    else
      group->push_back(&row);
  }
  for (auto& group : groups)
    std::ranges::stable_sort(
        group, [&](const StudyRow* a, const StudyRow* b) { return *a->values[key].number < *b->values[key].number; });
  return groups;
}

}  // namespace

std::string order_table(const StudyTable& table) {
  const Study& study = table.study;
  const bool by_plot = study.plot && std::ranges::find(study.keys, study.plot->x, &StudyKey::key) != study.keys.end();
  std::string rows;
  for (std::size_t key = 0; key < study.keys.size(); ++key) {
    if (by_plot && study.keys[key].key != study.plot->x) continue;
    for (const auto& group : along(table, key))
      for (std::size_t q = 0; q < study.quantities.size(); ++q)
        for (std::size_t k = 1; k < group.size(); ++k) {
          const StudyRow &a = *group[k - 1], &b = *group[k];
          const double x0 = *a.values[key].number, x1 = *b.values[key].number;
          if (!positive(a.errors[q]) || !positive(b.errors[q]) || x1 <= x0) continue;
          std::string others;
          for (std::size_t o = 0; o < study.keys.size(); ++o)
            if (o != key) others += fmt::format("{}{} = {}", others.empty() ? "" : ", ", study.keys[o].key, a.values[o].shown);
          rows += fmt::format("| {} | {} | {} | {} | {} | {:.2f} |\n", study.quantities[q].error_column(), others,
                              study.keys[key].key, a.values[key].shown, b.values[key].shown,
                              std::log(*b.errors[q] / *a.errors[q]) / std::log(x1 / x0));
        }
  }
  if (rows.empty()) return {};
  return "| error | with | key | from | to | observed order: error ~ key^order |\n| --- | --- | --- | --- | --- | --- |\n" + rows;
}

}  // namespace perikit
