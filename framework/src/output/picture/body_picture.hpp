#pragma once
/// gnuplot scripts for the pictures of bodies and curves.

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace perikit {

/// From a place, in the axes of the body.
struct BodyArrow {
  std::array<double, 3> from, along;
};

struct BodyPicture {
  int dimension = 3;                  ///< 2 or 3
  std::span<const double> reference;  ///< positions, rows of 3
  std::span<const double> drawn;      ///< positions as drawn, rows of 3
  std::span<const double> volume;     ///< per point
  std::span<const double> values;     ///< per point
  std::vector<bool> lone;             ///< per point, or empty: whether no bond joins it to others
  std::array<double, 2> range{};      ///< of the colours
  std::optional<std::array<double, 4>> window;   ///< 2D: from x to x and from y to y
  std::array<double, 3> view{};       ///< 3D: towards the eye
  std::vector<BodyArrow> arrows;
  std::vector<std::string> value_names;   ///< of the values 0, 1, ...; empty: they are numbers
  std::string title, value_label, length_unit;
  std::filesystem::path file;
};
std::string body_script(const BodyPicture& picture);

struct Curve {
  std::vector<double> x, y;   ///< NaN: a gap
  std::string name = {};
};

struct CurvePicture {
  std::vector<Curve> curves;   ///< of several the names are shown
  std::string title, x_label, y_label;
  std::string x_range, y_range;  ///< gnuplot's "[a:b]", or "[*:*]"
  std::filesystem::path file;
};
std::string curve_script(const CurvePicture& picture);

}  // namespace perikit
