#include "perikit/output/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "output/history_file.hpp"
#include "output/picture/axis_units.hpp"
#include "output/picture/body_picture.hpp"
#include "output/picture/field_values.hpp"
#include "output/picture/gnuplot.hpp"
#include "output/result_file.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/fields/point_field.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view history_prefix = "history:";

std::string labelled(const std::string& label, const std::string& unit) {
  return unit.empty() ? label : fmt::format("{} [{}]", label, unit);
}

std::string in_words(std::string column) {
  std::ranges::replace(column, '_', ' ');
  return column;
}

/// Smallest and largest value that is a number, a little apart where they are equal.
std::array<double, 2> range_of(std::span<const double> values) {
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    lower = std::min(lower, value);
    upper = std::max(upper, value);
  }
  if (lower > upper) return {0, 1};
  if (lower == upper)
    return lower == 0 ? std::array{0.0, 1.0} : std::array{lower - 0.01 * std::abs(lower), upper + 0.01 * std::abs(upper)};
  return {lower, upper};
}

/// Directions in which the points differ at all: a body in a plane lies in z = const, one on a line in y = z = const.
int dimension_of(std::span<const double> position) {
  int dimension = 1;
  for (std::size_t i = 0; i < position.size(); ++i) {
    if (i % 3 > 0 && position[i] != position[i % 3]) dimension = std::max(dimension, static_cast<int>(i % 3) + 1);
  }
  return dimension;
}

/// /frames/<frame>/<field>, else /reference/<field>. Throws InputError naming the fields that are there.
hdf5::Source::Array read_field(const ResultFile& results, const std::string& group, const std::string& field,
                               std::size_t points) {
  const hdf5::Source& source = results.source();
  std::vector<std::string> known = source.names(group, true);
  for (const char* name : {"volume", "material_id", "id"}) known.emplace_back(name);
  if (std::find(known.begin(), known.end(), field) == known.end()) {
    throw InputError({results.path().string(), 0, 0}, "field",
                     fmt::format("found '{}'; this run has {}{}", field, fmt::join(known, ", "),
                                 find_point_field(field) ? "; what a run writes stands in its scene: [output] fields" : did_you_mean(field, known)));
  }
  const std::string path = source.contains(group + "/" + field) ? group + "/" + field : "/reference/" + field;
  hdf5::Source::Array array = source.read(path);
  if (array.rows() != points) {
    throw InputError({results.path().string(), 0, 0}, path,
                     fmt::format("found {} points; the body has {}", array.rows(), points));
  }
  return array;
}

void plot_history(const PlotOptions& options, const std::string& name, const fs::path& picture) {
  const fs::path file = results_folder(options.results) / "history.csv";
  const History history = read_history(file);
  const auto found = std::find(history.columns.begin(), history.columns.end(), name);
  if (found == history.columns.end()) {
    throw InputError({file.string(), 0, 0}, "field",
                     fmt::format("found 'history:{}'; the columns are {}{}", name, fmt::join(history.columns, ", "),
                                 did_you_mean(name, history.columns)));
  }
  if (history.values[0].empty()) throw InputError({file.string(), 0, 0}, "", "holds no rows yet");
  const auto time = std::find(history.columns.begin(), history.columns.end(), "time");
  const std::size_t x = time == history.columns.end() ? 0 : static_cast<std::size_t>(time - history.columns.begin());
  CurvePicture curve;
  curve.x = history.values[x];
  curve.y = history.values[static_cast<std::size_t>(found - history.columns.begin())];
  const SceneUnits units(scene_text(file.parent_path()));
  // A scene with a unit of its own is not in SI.
  curve.x_label = labelled(in_words(history.columns[x]), options.unit ? "" : units.column(history.columns[x]));
  curve.y_label = labelled(in_words(name), options.unit.value_or(units.column(name)));
  curve.y_range = options.range ? fmt::format("[{}:{}]", (*options.range)[0], (*options.range)[1]) : "[*:*]";
  curve.file = picture;
  run_gnuplot(curve_script(curve), picture);
}

/// A body on a line: value over x.
std::string line_script(const PlotOptions& options, const BodyPicture& body) {
  std::vector<std::size_t> order(body.values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return body.reference[3 * a] < body.reference[3 * b]; });
  std::vector<double> x, y;
  for (const std::size_t p : order) {
    x.push_back(body.drawn[3 * p]);
    y.push_back(body.values[p]);
  }
  CurvePicture curve{x, y, body.title, labelled("x", body.length_unit), body.value_label, "[*:*]", body.file};
  if (options.range) curve.y_range = fmt::format("[{}:{}]", body.range[0], body.range[1]);
  return curve_script(curve);
}

void check_options(const PlotOptions& options) {
  if (!std::isfinite(options.deformed))
    throw InputError({}, "deformed", fmt::format("found {}; must be finite", options.deformed));
  double length = 0;
  for (const double component : options.view) length += component * component;
  if (!(length > 0) || !std::isfinite(length)) throw InputError({}, "view", "must be a direction, not zero or infinite");
  if (options.range && !((*options.range)[0] < (*options.range)[1])) {
    throw InputError({}, "range",
                     fmt::format("found {} ... {}; the first must be smaller", (*options.range)[0], (*options.range)[1]));
  }
}

void plot_frame(const PlotOptions& options, const ResultFile& results, std::int64_t frame, const fs::path& picture) {
  const std::string group = results.frame_group(frame);
  const hdf5::Source& source = results.source();
  const hdf5::Source::Array position = source.read("/reference/position"), volume = source.read("/reference/volume");
  const std::size_t points = position.rows();
  const hdf5::Source::Array data = read_field(results, group, options.field, points);
  const FieldValues values = field_values(options.field, data.width(), data.data, options.component);

  std::vector<double> drawn = position.data;
  if (options.deformed != 0) {
    const hdf5::Source::Array displacement = read_field(results, group, "displacement", points);
    for (std::size_t i = 0; i < drawn.size(); ++i) drawn[i] += options.deformed * displacement.data[i];
  }
  const std::string title = source.text("/", "title"), unit = SceneUnits(source.text("/", "scene")).time();
  const std::string time = fmt::format("t = {:.6g}{}{}", source.real(group, "time"), unit.empty() || options.unit ? "" : " ", options.unit ? "" : unit);
  BodyPicture body;
  body.dimension = dimension_of(position.data);
  body.reference = position.data;
  body.drawn = drawn;
  body.volume = volume.data;
  body.values = values.values;
  body.range = options.range ? *options.range : range_of(values.values);
  body.view = options.view;
  body.title = title.empty() ? time : title + ", " + time;
  body.value_label = labelled(values.label, options.unit.value_or(values.unit));
  body.length_unit = std::string(options.unit ? "" : "m");
  body.file = picture;
  run_gnuplot(body.dimension == 1 ? line_script(options, body) : body_script(body), picture);
}

}  // namespace

fs::path plot(const PlotOptions& options) {
  check_options(options);
  const fs::path folder = results_folder(options.results);
  if (options.field.starts_with(history_prefix)) {
    const std::string name = options.field.substr(history_prefix.size());
    const fs::path picture = options.output.empty() ? folder / fmt::format("history_{}.png", name) : options.output;
    plot_history(options, name, picture);
    return picture;
  }
  const ResultFile results(options.results);
  const std::int64_t frame = options.frame.value_or(results.frames().empty() ? 0 : results.frames().back());
  const std::string component = options.component.empty() ? "" : fmt::format("_{}", options.component);
  const fs::path picture =
      options.output.empty() ? folder / fmt::format("{}{}_{}.png", options.field, component, frame_name(frame)) : options.output;
  plot_frame(options, results, frame, picture);
  return picture;
}

}  // namespace perikit
