#include "run/study_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "output/picture/gnuplot.hpp"
#include "run/study_axes.hpp"
#include "run/study_series.hpp"

namespace perikit {

void draw(const StudyTable& table, const std::filesystem::path& picture) {
  // Told apart also without colour: the marks differ.
  constexpr std::array colours{"#1c61a8", "#d1495b", "#2e8b57", "#e09f3e", "#6a4c93", "#3a3a3a", "#17a2a2", "#8c564b"};
  constexpr std::array marks{7, 5, 9, 11, 13, 6, 4};   // fewer than colours: the pairs repeat late
  const StudyPlot& plot = *table.study.plot;
  const std::vector<StudySeries> lines = plotted_series(table);
  if (lines.empty()) throw RunError(fmt::format("{}: no run gives numbers for {} and {}", picture.string(), plot.x, plot.y));

  std::string script = gnuplot_terminal(picture, 1100, 750);
  script += axes(table);
  script +=
      "set grid lt 1 lw 1 lc rgb '#dddddd'\nset tics out nomirror\nset offsets graph 0.03, graph 0.03, graph 0.05, graph 0.05\n";
  const bool wide = std::ranges::any_of(lines, [](const StudySeries& line) { return line.name.size() > 24; });  // would leave no room beside it
  script += plot.series.empty() ? "unset key\n"
                                : wide                ? fmt::format("set key below center maxrows {} samplen 1.5 width -3 font ',12'\n", (lines.size() + 1) / 2)
                                  : fmt::format("set key outside right top title {}\n", gnuplot_quoted(plot.series));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    script += fmt::format("$line{} << end\n", i);
    for (const auto& [x, y] : lines[i].points) script += fmt::format("{} {}\n", x, y);
    script += "end\n";
  }
  if (plot.level) script += fmt::format("set arrow from graph 0, first {0} to graph 1, first {0} nohead dt 2 lc rgb '#777777'\n", *plot.level);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    script += fmt::format("{} $line{} using 1:2 with linespoints lw 1.5 ps 1.1 pt {} lc rgb '{}' title {}", i == 0 ? "plot" : ",",
                          i, marks[i % marks.size()], colours[i % colours.size()], gnuplot_quoted(lines[i].name));
  }
  run_gnuplot(script + "\n", picture);
}

}  // namespace perikit
