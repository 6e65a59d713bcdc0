#pragma once
/// Colours of values: dark blue to yellow, growing evenly in lightness, so that it also reads in grey and with colour-blind eyes.

#include <string>

#include "output/picture/raster.hpp"

namespace perikit {

/// The colour at `fraction` of the range (clamped to 0 ... 1); grey where it is not a number.
Colour map_colour(double fraction);

/// The same map as gnuplot's `set palette` line.
std::string gnuplot_palette();

}  // namespace perikit
