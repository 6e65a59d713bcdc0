#pragma once
/// Pictures of results without ParaView, drawn through gnuplot.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace perikit {

struct PlotOptions {
  std::filesystem::path results;           ///< folder of a run, or its results.h5
  std::string field = "displacement";      ///< a field of the frame or of /reference; "history:NAME": a column of history.csv
  std::optional<std::int64_t> frame;       ///< default: the last one
  std::string component;                   ///< vectors: x, y, z, magnitude (default); tensors: xx, xy, ... zz, magnitude, trace,
                                           ///< determinant, von_mises (default for stresses)
  double deformed = 0;                     ///< points drawn at position + deformed * displacement
  std::filesystem::path output;            ///< .png, .svg or .pdf; default: a PNG named after field and frame in the run's folder
  std::array<double, 3> view{1, -1, 0.6};  ///< 3D: direction from the body to the eye, z upwards
  std::optional<std::array<double, 2>> range;  ///< of the colours (1D: of the value axis); default: the values of the frame
  std::optional<std::string> unit;             ///< shown behind the field's name; default: the SI unit of known fields
};

/// Draws a field at one frame: bodies in a plane as filled cells over equal axes, solid bodies as shaded cells in orthographic
/// projection, bodies on a line as value over x. Returns the path of the picture. Throws InputError for an unknown field,
/// component, frame or file type, RunError where gnuplot is missing or fails.
std::filesystem::path plot(const PlotOptions& options);

}  // namespace perikit
