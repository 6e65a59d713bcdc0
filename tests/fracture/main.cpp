/// Draws the damage of several runs side by side and prints what they measured as a Markdown table.
///   perikit_fracture PICTURE COLUMNS RAYLEIGH_SPEED [FOLDER LABEL]...

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "output/picture/colour_map.hpp"
#include "output/picture/gnuplot.hpp"
#include "perikit/core/errors.hpp"
#include "tests/fracture/crack.hpp"

using namespace perikit;
using namespace perikit::fracture;

namespace {

struct Panel {
  std::string label;
  Crack crack;
};

std::string script(const std::vector<Panel>& panels, std::size_t columns, const std::string& picture) {
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  const Layer& first = panels.front().crack.layer;
  const double shape = (first.y.back() - first.y.front()) / (first.x.back() - first.x.front());
  constexpr int width = 420;
  const int height = static_cast<int>(width * shape) + 30;
  std::string text = gnuplot_terminal(picture, static_cast<int>(columns) * width, static_cast<int>(rows) * height + 60);
  text += gnuplot_palette();
  text += fmt::format("set cbrange [0:1]\nunset key\nunset tics\nset size ratio {}\nunset colorbox\nset multiplot\n", shape);
  const double bottom = 60.0 / (static_cast<double>(rows) * height + 60);
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const Layer& layer = panels[k].crack.layer;
    const double w = 1.0 / static_cast<double>(columns), h = (1 - bottom) / static_cast<double>(rows);
    const double left = static_cast<double>(k % columns) * w, low = bottom + static_cast<double>(rows - 1 - k / columns) * h;
    text +=
        fmt::format("set lmargin at screen {}\nset rmargin at screen {}\nset bmargin at screen {}\nset tmargin at screen {}\n",
                    left + 0.03 * w, left + 0.97 * w, low + 0.02 * h, low + 0.98 * h - 26 * h / height);
    const std::string stopped = panels[k].crack.ended ? "" : fmt::format(", stopped at {:.3g} us", 1e6 * panels[k].crack.end);
    text += fmt::format("set title {} noenhanced offset 0,-0.7 font \",12\"\n",
                        gnuplot_quoted(fmt::format("({}) {}{}", static_cast<char>('A' + k), panels[k].label, stopped)));
    text += fmt::format("$panel{} << EOD\n", k);
    for (std::size_t row = 0; row < layer.y.size(); ++row) {
      for (std::size_t column = 0; column < layer.x.size(); ++column) text += fmt::format("{:.2f} ", layer.at(column, row));
      text += "\n";
    }
    text += fmt::format("EOD\nset xrange [-0.5:{}]\nset yrange [-0.5:{}]\n", static_cast<double>(layer.x.size()) - 0.5,
                        static_cast<double>(layer.y.size()) - 0.5);
    if (k + 1 == panels.size()) {
      text += fmt::format(
          "set colorbox user horizontal origin screen 0.3, screen {} size screen 0.4, screen {}\nset cblabel \"damage\" offset "
          "0,0.3 font \",11\"\nset cbtics 0.25 offset 0,0.7 font \",10\"\n",
          0.62 * bottom, 0.2 * bottom);
    }
    text += fmt::format("plot $panel{} matrix with image\n", k);
  }
  return text + "unset multiplot\n";
}

void print_table(const std::vector<Panel>& panels, double rayleigh) {
  fmt::print(
      "| | run | end | crack tip | stray | first branch | arms | speed / Rayleigh | dissipated | balance off | largest "
      "displacement, fragments |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const Crack& c = panels[k].crack;
    fmt::print(
        "| {} | {} | {:.3g} us{} | {:.4g} mm | {:.3g} mm | {} | {} | {:.2f} | {:.3g} J | {:.2g} % | {:.2g} mm, {:.2g} mm |\n",
        static_cast<char>('A' + k), panels[k].label, 1e6 * c.end, c.ended ? "" : " (stopped)", 1e3 * c.tip, 1e3 * c.stray,
        c.branch < 0 ? "none" : fmt::format("{:.3g} mm", 1e3 * c.branch), c.arms, c.speed / rayleigh, c.dissipated,
        100 * c.balance, 1e3 * c.displacement, 1e3 * c.fragments);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 6 || argc % 2 != 0) {
    fmt::print(stderr, "usage: perikit_fracture PICTURE COLUMNS RAYLEIGH_SPEED [FOLDER LABEL]...\n");
    return 2;
  }
  std::vector<Panel> panels;
  for (int k = 4; k + 1 < argc; k += 2) panels.push_back({argv[k + 1], measure(argv[k])});
  run_gnuplot(script(panels, static_cast<std::size_t>(std::atoi(argv[2])), argv[1]), argv[1]);
  print_table(panels, std::atof(argv[3]));
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "perikit_fracture: {}\n", error.what());
  return 1;
}
