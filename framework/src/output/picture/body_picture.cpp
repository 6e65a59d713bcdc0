#include "output/picture/body_picture.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "output/picture/colour_map.hpp"
#include "output/picture/gnuplot.hpp"
#include "output/picture/point_cells.hpp"

namespace perikit {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Rows: right, up, towards the eye.
Matrix3d view_axes(int dimension, const std::array<double, 3>& view) {
  if (dimension == 2) return Matrix3d::Identity();
  const Vector3d eye = Vector3d(view[0], view[1], view[2]).normalized();
  Vector3d right = Vector3d::UnitZ().cross(eye);
  if (right.norm() < 1e-6) right = Vector3d::UnitX();  // looking along z
  right.normalize();
  Matrix3d axes;
  axes << right.transpose(), eye.cross(right).transpose(), eye.transpose();
  return axes;
}

/// The part of the projection plane that the picture shows.
struct Frame {
  Eigen::Vector2d lower, upper;
  Eigen::Vector2d size() const { return upper - lower; }
};

Frame frame_around(const std::vector<PointCell>& cells, const std::vector<BodyArrow>& arrows, const Matrix3d& axes) {
  Frame frame{Eigen::Vector2d::Constant(INFINITY), Eigen::Vector2d::Constant(-INFINITY)};
  for (const PointCell& cell : cells) {
    if (!cell.centre.allFinite() || !cell.half_edge.allFinite()) continue;
    const Eigen::Vector2d reach = cell.half_edge.cwiseAbs().rowwise().sum().head<2>();
    frame.lower = frame.lower.cwiseMin(cell.centre.head<2>() - reach);
    frame.upper = frame.upper.cwiseMax(cell.centre.head<2>() + reach);
  }
  for (const BodyArrow& arrow : arrows) {
    const Eigen::Vector2d tip = (axes * (Vector3d(arrow.from.data()) + Vector3d(arrow.along.data()))).head<2>();
    frame.lower = frame.lower.cwiseMin(tip);
    frame.upper = frame.upper.cwiseMax(tip);
  }
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(0.03 * frame.size().maxCoeff());
  return {frame.lower - margin, frame.upper + margin};
}

Colour shaded(const Colour& colour, const Vector3d& normal) {
  static const Vector3d light = Vector3d(-0.3, 0.5, 0.8).normalized();  // over the viewer's left shoulder
  const double brightness = 0.6 + 0.42 * std::max(0.0, normal.dot(light));
  return static_cast<float>(brightness) * colour;
}

/// The faces of a cell that are turned to the eye.
void draw_cube(Raster& raster, const PointCell& cell, const Colour& colour) {
  for (int k = 0; k < 3; ++k) {
    const Vector3d a = cell.half_edge.col((k + 1) % 3), b = cell.half_edge.col((k + 2) % 3);
    Vector3d face = cell.half_edge.col(k), normal = a.cross(b).normalized();
    if (normal.dot(face) < 0) normal = -normal;
    if (normal.z() < 0) {
      normal = -normal;
      face = -face;
    }
    // The steps of a lattice are softened towards the shade of the smooth surface.
    const Vector3d blended = cell.normal.z() > 0 ? (normal + 0.7 * cell.normal).normalized() : normal;
    raster.fill(cell.centre + face, a, b, shaded(colour, blended));
  }
}

/// Bytes of the drawn body over `frame`, `columns` x `rows` pixels.
std::vector<std::uint8_t> draw_cells(const PointCells& body, const BodyPicture& picture, const Frame& frame, int columns,
                                     int rows) {
  constexpr int samples = 3;  // per pixel and direction
  Raster raster(columns * samples, rows * samples);
  const double scale = columns * samples / frame.size().x();
  // Larger cells close the gaps between irregular points, and in a plane also the seams between cells that deform differently:
  // there each pixel goes to the nearest point.
  const bool plane = picture.dimension == 2;
  const double widened = body.regular ? (plane ? 1.04 : 1) : (plane ? 2.3 : 1.5);
  for (std::size_t p = 0; p < body.cells.size(); ++p) {
    PointCell cell = body.cells[p];
    cell.centre.head<2>() -= frame.lower;
    cell.centre *= scale;
    if (cell.dot) {
      const double radius = 0.8 * scale * cell.half_edge.col(0).norm();
      raster.disc(cell.centre, std::max(radius, 1.5 * samples), map_colour((picture.values[p] - picture.range[0]) / (picture.range[1] - picture.range[0])));
      continue;
    }
    cell.half_edge *= scale * widened;
    const Colour colour = map_colour((picture.values[p] - picture.range[0]) / (picture.range[1] - picture.range[0]));
    if (plane) {
      raster.fill(cell.centre, cell.half_edge.col(0), cell.half_edge.col(1), colour, 1.0);
    } else {
      draw_cube(raster, cell, colour);
    }
  }
  return raster.rgba(samples);
}

/// 1, 2 or 5 times a power of ten, at most `length`.
double round_length(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= length) return factor * power;
  }
  return power;
}

/// Directions of the axes and a length to compare with, in place of the axes that a projection cannot have. Offsets are in
/// pixels.
std::string triad_and_scale(const Matrix3d& axes, const Frame& frame, double pixels_per_length, int left, int bottom,
                            const std::string& unit, int width, int height) {
  std::string text;
  const double x = left, y = bottom;
  const char* names = "xyz";
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d tip = 55 * axes.col(k).head<2>(), label = 75 * axes.col(k).head<2>();
    if (tip.norm() < 8) continue;
    text += fmt::format("set arrow from screen {},{} to screen {},{} lw 2 lc rgb '#333333' front\n", x / width, y / height,
                        (x + tip.x()) / width, (y + tip.y()) / height);
    text +=
        fmt::format("set label '{}' at screen {},{} center front\n", names[k], (x + label.x()) / width, (y + label.y()) / height);
  }
  const double length = round_length(0.25 * frame.size().maxCoeff());
  const double start = x + 110;
  text += fmt::format("set arrow from screen {},{} to screen {},{} nohead lw 4 lc rgb '#333333' front\n", start / width,
                      (y - 35) / height, (start + length * pixels_per_length) / width, (y - 35) / height);
  text += fmt::format("set label {} at screen {},{} left front\n", gnuplot_quoted(fmt::format("{:g} {}", length, unit)),
                      start / width, (y - 12) / height);
  return text;
}

/// In the plane of the picture.
std::string arrows_of(const BodyPicture& picture, const Matrix3d& axes) {
  std::string text;
  for (const BodyArrow& arrow : picture.arrows) {
    const Vector3d from = axes * Vector3d(arrow.from.data()), to = from + axes * Vector3d(arrow.along.data());
    text += fmt::format("set arrow from {},{} to {},{} size screen 0.012,25 filled lw 1.5 lc rgb '#c02020' front\n", from.x(), from.y(), to.x(), to.y());
  }
  return text;
}

/// Values that have names are no numbers.
std::string names_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) text += fmt::format("{}{} {}", k > 0 ? ", " : "", gnuplot_quoted(names[k]), k);
  return names.empty() ? text : fmt::format("set cbtics ({})\n", text);
}

}  // namespace

std::string body_script(const BodyPicture& picture) {
  PointCells body = make_point_cells(picture.dimension, picture.reference, picture.drawn, picture.volume, picture.lone);
  const Matrix3d axes = view_axes(picture.dimension, picture.view);
  for (PointCell& cell : body.cells) {
    cell.centre = axes * cell.centre;
    cell.half_edge = axes * cell.half_edge;
    cell.normal = axes * cell.normal;
  }
  const Frame frame = picture.window ? Frame{{(*picture.window)[0], (*picture.window)[2]}, {(*picture.window)[1], (*picture.window)[3]}} : frame_around(body.cells, picture.arrows, axes);
  const double scale = std::min(1150 / frame.size().x(), 850 / frame.size().y());
  const int columns = std::max(1, static_cast<int>(std::lround(scale * frame.size().x())));
  const int rows = std::max(1, static_cast<int>(std::lround(scale * frame.size().y())));
  const bool wide = columns > 2 * rows, solid = picture.dimension == 3;
  const int left = solid ? 60 : 175, right = wide ? 60 : 250, top = 60;
  const int bottom = (solid ? 150 : 110) + (wide ? 120 : 0);
  const int width = std::max(columns, 420) + left + right, height = rows + top + bottom;

  std::string script = gnuplot_terminal(picture.file, width, height) + gnuplot_palette();
  const auto screen_x = [&](double pixels) { return pixels / width; };
  const auto screen_y = [&](double pixels) { return pixels / height; };
  script +=
      fmt::format("set lmargin at screen {}\nset rmargin at screen {}\nset bmargin at screen {}\nset tmargin at screen {}\n",
                  screen_x(left), screen_x(left + columns), screen_y(bottom), screen_y(bottom + rows));
  script += fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset cbrange [{}:{}]\n", frame.lower.x(), frame.upper.x(),
                        frame.lower.y(), frame.upper.y(), picture.range[0], picture.range[1]);
  // Centred over the whole picture: the plot itself may be much narrower than its title.
  script += fmt::format("set label 1 {} at screen 0.5, screen 0.98 center\nset cbtics out\nset format cb '%g'\nunset key\n", gnuplot_quoted(picture.title));
  // The label of the bar has a place of its own, because gnuplot's own one runs into long numbers.
  const std::string value_label = gnuplot_quoted(picture.value_label);
  if (wide) {
    script += fmt::format("set colorbox horizontal user origin screen {},screen {} size screen {},screen {}\n",
                          screen_x(left + 0.2 * columns), screen_y(100), screen_x(0.6 * columns), screen_y(22));
    script += fmt::format("set label {} at screen {},{} center\n", value_label, screen_x(left + 0.5 * columns), screen_y(25));
  } else {
    script += fmt::format("set colorbox vertical user origin screen {},screen {} size screen {},screen {}\n",
                          screen_x(left + columns + 25), screen_y(bottom + 0.1 * rows), screen_x(24), screen_y(0.8 * rows));
    script += fmt::format("set label {} at screen {},{} center rotate by 90\n", value_label, screen_x(left + columns + 215),
                          screen_y(bottom + 0.5 * rows));
  }
  if (solid) {
    script += "unset border\nunset tics\nset cbtics\n";
    script += triad_and_scale(axes, frame, scale, left + 60, bottom - 75, picture.length_unit, width, height);
  } else {
    const std::string unit = picture.length_unit.empty() ? "" : fmt::format(" [{}]", picture.length_unit);
    script += fmt::format("set xlabel 'x{0}'\nset ylabel 'y{0}'\nset tics out nomirror\n", unit);
    if (wide) script += fmt::format("set ytics {}\n", round_length(0.5 * frame.size().y()));  // a low picture has room for few
  }
  script += arrows_of(picture, axes) + names_of(picture.value_names);
  // The single point outside the picture makes gnuplot draw the colour bar; the body itself comes as pixels.
  const double pixel = frame.size().x() / columns;
  script +=
      fmt::format("$bar << end\n{} {} {}\nend\n", frame.lower.x() - 1e3 * pixel, frame.lower.y() - 1e3 * pixel, picture.range[0]);
  script += fmt::format(
      "plot $bar using 1:2:3 with points pt 7 palette, '-' binary array=({},{}) origin=({},{}) dx={} dy={} "
      "format='%uchar' using 1:2:3:4 with rgbalpha\n",
      columns, rows, frame.lower.x() + pixel / 2, frame.lower.y() + pixel / 2, pixel, frame.size().y() / rows);
  const std::vector<std::uint8_t> bytes = draw_cells(body, picture, frame, columns, rows);
  script.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return script;
}

std::string curve_script(const CurvePicture& picture) {
  constexpr std::array colours{"#1c61a8", "#d1495b", "#2e8b57", "#e09f3e", "#6a4c93", "#3a3a3a", "#17a2a2", "#8c564b"};
  constexpr std::array marks{7, 5, 9, 11, 13, 6, 4};   // fewer than colours: the pairs repeat late
  const bool several = picture.curves.size() > 1;
  std::string script = gnuplot_terminal(picture.file, 1150, 750);
  script += fmt::format("set title {}\nset xlabel {}\nset ylabel {}\nset xrange {}\nset yrange {}\n", gnuplot_quoted(picture.title),
                        gnuplot_quoted(picture.x_label), gnuplot_quoted(picture.y_label), picture.x_range, picture.y_range);
  script += several ? "set key below left Left reverse samplen 2\n" : "unset key\n";
  script += "set datafile missing 'nan'\nset grid lt 1 lw 1 lc rgb '#dddddd'\nset tics out nomirror\nset rmargin 4\n";
  std::string plots;
  for (std::size_t k = 0; k < picture.curves.size(); ++k) {
    const Curve& curve = picture.curves[k];
    script += fmt::format("$curve{} << end\n", k);
    for (std::size_t i = 0; i < curve.x.size(); ++i) script += fmt::format("{} {}\n", curve.x[i], curve.y[i]);
    script += "end\n";
    // Few points are shown as points too.
    plots += fmt::format("{} $curve{} using 1:2 with {} lw 2.5 lc rgb '{}' title {}", k == 0 ? "plot" : ",", k,
                         curve.x.size() <= 60 ? fmt::format("linespoints pt {} ps 0.7", marks[k % marks.size()]) : "lines", colours[k % colours.size()],
                         gnuplot_quoted(curve.name));
  }
  return script + plots + "\n";
}

}  // namespace perikit
