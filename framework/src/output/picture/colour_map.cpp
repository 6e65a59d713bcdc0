#include "output/picture/colour_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace perikit {

namespace {

/// Equally spaced colours; between them the map is linear.
const std::array<Colour, 8> colours{Colour(0.16f, 0.06f, 0.38f), Colour(0.18f, 0.22f, 0.58f), Colour(0.11f, 0.38f, 0.66f),
                                    Colour(0.05f, 0.53f, 0.65f), Colour(0.14f, 0.66f, 0.55f), Colour(0.42f, 0.78f, 0.40f),
                                    Colour(0.74f, 0.86f, 0.27f), Colour(0.98f, 0.92f, 0.28f)};

}  // namespace

Colour map_colour(double fraction) {
  if (std::isnan(fraction)) return Colour::Constant(0.6f);
  const double place = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(colours.size() - 1);
  const std::size_t lower = std::min(static_cast<std::size_t>(place), colours.size() - 2);
  const float weight = static_cast<float>(place - static_cast<double>(lower));
  return (1 - weight) * colours[lower] + weight * colours[lower + 1];
}

std::string gnuplot_palette() {
  std::string text = "set palette defined (";
  for (std::size_t k = 0; k < colours.size(); ++k) {
    text += fmt::format("{}{} {} {} {}", k == 0 ? "" : ", ", k, colours[k][0], colours[k][1], colours[k][2]);
  }
  return text + ")\n";
}

}  // namespace perikit
