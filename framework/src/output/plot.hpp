#pragma once
/// Pictures of results without ParaView, drawn through gnuplot.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace perikit {

struct PlotOptions {
  std::vector<std::filesystem::path> results;   ///< folder of a run, or its results.h5; curves: of several runs
  std::string field = "displacement";      ///< a field of the frame or of /reference; "history:NAME": as y = "NAME"
  std::string x, y;                        ///< columns of history.csv: a curve of y over x (empty: time) in place of a picture of the body
  std::optional<std::int64_t> frame;       ///< default: the last one
  std::string component;                   ///< vectors: x, y, z, magnitude (default); tensors: xx, xy, ... zz, magnitude, trace,
                                           ///< determinant, von_mises (default for stresses)
  double deformed = 0;                     ///< points drawn at position + deformed * displacement
  std::filesystem::path output;            ///< .png, .svg or .pdf; default: a PNG named after field and frame in the run's folder
  std::array<double, 3> view{1, -1, 0.6};  ///< 3D: direction from the body to the eye, z upwards
  std::optional<std::array<double, 2>> range;  ///< of the colours (1D and curves: of the value axis); default: the values of the frame
  std::optional<std::array<double, 4>> window; ///< from x to x and from y to y: the part of the picture that is drawn
  std::optional<std::string> unit;             ///< shown behind the field's name; default: the SI unit of known fields
};

/// Draws a field at one frame: bodies in a plane as filled cells over equal axes, solid bodies as shaded cells in orthographic
/// projection, bodies on a line as value over x; where the frame has `damage` or `fragment`, points of a plane or solid body that no bond joins to
/// others as dots. With x or y curves of the histories, a line for each run. Returns the path of the picture. Throws InputError for an unknown field,
/// component, column, frame or file type, RunError where gnuplot is missing or fails.
std::filesystem::path plot(const PlotOptions& options);

class Simulation;

/// The body of a scene before its run, in a plane or in space: what is held, what is loaded and where to at the end, which points sets hold. Throws
/// InputError for a body on a line and another file type, RunError where gnuplot is missing or fails.
void plot_overview(Simulation& simulation, const std::filesystem::path& picture);

}  // namespace perikit
