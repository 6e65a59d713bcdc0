#include "study/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "output/picture/gnuplot.hpp"
#include "study/axes.hpp"
#include "study/series.hpp"

namespace perikit {

namespace {

constexpr int width = 1100, height = 750;

/// A key under the plot, in as many columns as its longest name leaves room for, and the height that it takes [pixels].
struct Key {
  std::string script;
  int height = 0;
};

Key key_below(const std::vector<StudySeries>& lines, const std::filesystem::path& picture) {
  constexpr double of_a_letter = 8.2, of_a_mark = 60, of_a_row = 20, font = 12;   // for this size of the letters
  std::size_t longest = 1;
  for (const StudySeries& line : lines) longest = std::max(longest, line.name.size());
  const double needed = of_a_letter * static_cast<double>(longest) + of_a_mark, room = width - 40;
  const auto columns = static_cast<std::size_t>(std::max(1.0, std::floor(room / needed)));
  const std::size_t rows = (lines.size() + columns - 1) / columns;
  const double scale = std::min(1.0, (room - of_a_mark) / (of_a_letter * static_cast<double>(longest)));   // of one name that fills more than the picture
  // Letters of PDF are measured in points of the page (see gnuplot_terminal).
  const double size = font * scale * (picture.extension() == ".pdf" ? 8.0 / 18 : 1.0);
  return {fmt::format("set key below left Left reverse height 0.6 maxrows {} samplen 1.5 font ',{:.3g}'\n", rows, size), static_cast<int>(of_a_row * static_cast<double>(rows))};
}

/// " (2 failed, 1 refused)" for runs that are not in the picture.
std::string words_of_missing(const StudySeries& line) {
  std::string words;
  for (const auto& [what, count] : line.missing) words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, what);
  return words.empty() ? words : fmt::format(" ({}{})", line.points.empty() ? "no point: " : "", words);
}

}  // namespace

void draw(const StudyTable& table, const std::filesystem::path& picture) {
  // Told apart also without colour: the marks differ.
  constexpr std::array colours{"#1c61a8", "#d1495b", "#2e8b57", "#e09f3e", "#6a4c93", "#3a3a3a", "#17a2a2", "#8c564b"};
  constexpr std::array marks{7, 5, 9, 11, 13, 6, 4};   // fewer than colours: the pairs repeat late
  const StudyPlot& plot = *table.study.plot;
  std::vector<StudySeries> lines = plotted_series(table);
  if (std::ranges::all_of(lines, [](const StudySeries& line) { return line.points.empty(); })) throw RunError(fmt::format("{}: no run gives numbers for {} and {}", picture.string(), plot.x, plot.y));

  const std::string series = series_title(table);
  const bool some_missing = std::ranges::any_of(lines, [](const StudySeries& line) { return !line.missing.empty(); });
  for (StudySeries& line : lines) line.name += words_of_missing(line);
  const bool wide = (!series.empty() || some_missing) && std::ranges::any_of(lines, [](const StudySeries& line) { return line.name.size() > 24; });  // would leave no room beside it
  const Key below = wide ? key_below(lines, picture) : Key();
  std::string script = gnuplot_terminal(picture, width, height + below.height);
  script += axes(table);
  script +=
      "set grid lt 1 lw 1 lc rgb '#dddddd'\nset tics out nomirror\nset offsets graph 0.03, graph 0.03, graph 0.05, graph 0.05\n";
  script += series.empty() && !some_missing ? "unset key\n"
                : wide      ? below.script
                            : fmt::format("set key outside right top title {}\n", gnuplot_quoted(series));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].points.empty()) lines[i].points.emplace_back(NAN, NAN);   // its name alone, in the key
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
