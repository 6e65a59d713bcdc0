#include "run/study_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "output/picture/gnuplot.hpp"
#include "run/study_axes.hpp"

namespace perikit {

namespace {

struct Line {
  std::string name;
  std::string points;  ///< rows "x y"
};

std::vector<Line> lines_of(const StudyTable& table, const StudyPlot& plot) {
  const auto drawable = [&](const std::optional<double>& value, char axis) {
    const bool logarithmic = plot.log.find(axis) != std::string::npos;
    return value && std::isfinite(*value) && (!logarithmic || *value > 0);
  };
  const auto& keys = table.study.keys;
  const auto series = static_cast<std::size_t>(std::ranges::find(keys, plot.series, &StudyKey::key) - keys.begin());
  std::vector<Line> lines;
  for (const StudyRow& row : table.rows) {
    const auto x = table.number(row, plot.x), y = table.number(row, plot.y);
    if (!drawable(x, 'x') || !drawable(y, 'y')) continue;
    const std::string name = series < keys.size() ? row.values[series].shown : plot.y;
    auto line = std::ranges::find(lines, name, &Line::name);
    if (line == lines.end()) line = lines.insert(lines.end(), Line{name, ""});
    line->points += fmt::format("{} {}\n", *x, *y);
  }
  return lines;
}

}  // namespace

void draw(const StudyTable& table, const std::filesystem::path& picture) {
  // Told apart also without colour: the marks differ.
  constexpr std::array colours{"#1c61a8", "#d1495b", "#2e8b57", "#e09f3e", "#6a4c93", "#3a3a3a", "#17a2a2", "#8c564b"};
  constexpr std::array marks{7, 5, 9, 11, 13, 6, 4, 8};
  const StudyPlot& plot = *table.study.plot;
  const std::vector<Line> lines = lines_of(table, plot);
  if (lines.empty()) throw RunError(fmt::format("{}: no run gives numbers for {} and {}", picture.string(), plot.x, plot.y));

  std::string script = gnuplot_terminal(picture, 1150, 750);
  script += axes(table);
  script +=
      "set grid lt 1 lw 1 lc rgb '#dddddd'\nset tics out nomirror\nset offsets graph 0.05, graph 0.05, graph 0.08, graph 0.08\n";
  const bool wide = std::ranges::any_of(lines, [](const Line& line) { return line.name.size() > 24; });  // would leave no room beside it
  script += plot.series.empty() ? "unset key\n"
                                : fmt::format("set key {} title {}\n", wide ? "below" : "outside right top", gnuplot_quoted(plot.series));
  for (std::size_t i = 0; i < lines.size(); ++i) script += fmt::format("$line{} << end\n{}end\n", i, lines[i].points);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    script += fmt::format("{} $line{} using 1:2 with linespoints lw 2 ps 1.4 pt {} lc rgb '{}' title {}", i == 0 ? "plot" : ",",
                          i, marks[i % marks.size()], colours[i % colours.size()], gnuplot_quoted(lines[i].name));
  }
  run_gnuplot(script + "\n", picture);
}

}  // namespace perikit
