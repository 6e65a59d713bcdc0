#include "output/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "output/history_file.hpp"
#include "output/picture/axis_units.hpp"
#include "output/picture/body_picture.hpp"
#include "output/picture/field_values.hpp"
#include "output/picture/gnuplot.hpp"
#include "output/result_file.hpp"
#include "output_fields/point_field.hpp"
#include "output_fields/state_field.hpp"
#include "perikit/core/errors.hpp"

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
  for (std::string& name : known) name = field_of(std::move(name));
  for (const char* name : {"volume", "material_id", "id"}) known.emplace_back(name);
  if (std::find(known.begin(), known.end(), field) == known.end()) {
    throw InputError({results.path().string(), 0, 0}, "field",
                     fmt::format("found '{}'; this run has {}{}", field, fmt::join(known, ", "),
                                 find_point_field(field) || names_state(field) ? "; what a run writes stands in its scene: [output] fields" : did_you_mean(field, known)));
  }
  const std::string frame = group + "/" + dataset_of(field), path = source.contains(frame) ? frame : "/reference/" + field;
  hdf5::Source::Array array = source.read(path);
  if (array.rows() != points) {
    throw InputError({results.path().string(), 0, 0}, path,
                     fmt::format("found {} points; the body has {}", array.rows(), points));
  }
  return array;
}

/// The column of a history; InputError with the names that there are.
const std::vector<double>& column_of(const History& history, const std::string& name, const fs::path& file, const char* key) {
  const auto found = std::ranges::find(history.columns, name);
  if (found == history.columns.end()) {
    throw InputError({file.string(), 0, 0}, key,
                     fmt::format("found '{}'; the columns are {}{}", name, fmt::join(history.columns, ", "), did_you_mean(name, history.columns)));
  }
  const std::vector<double>& values = history.values[static_cast<std::size_t>(found - history.columns.begin())];
  if (values.empty()) throw InputError({file.string(), 0, 0}, "", "holds no rows yet");
  return values;
}

/// What runs are called in one picture: their folders' names, or where two have the same one, all of their paths.
std::vector<std::string> names_of(const std::vector<fs::path>& folders) {
  std::vector<std::string> names;
  for (const fs::path& folder : folders) names.push_back((folder.filename().empty() ? folder.parent_path() : folder).filename().string());
  std::vector<std::string> sorted = names;
  std::ranges::sort(sorted);
  if (std::ranges::adjacent_find(sorted) == sorted.end()) return names;
  for (std::size_t k = 0; k < names.size(); ++k) names[k] = folders[k].string();
  return names;
}

std::string range_text(double from, double to) { return fmt::format("[{}:{}]", from, to); }

void plot_curves(const PlotOptions& options, const std::string& x, const std::string& y, const std::vector<fs::path>& folders, const fs::path& picture) {
  CurvePicture curves;
  const std::vector<std::string> names = names_of(folders);
  for (std::size_t k = 0; k < folders.size(); ++k) {
    const fs::path file = folders[k] / "history.csv";
    const History history = read_history(file);
    curves.curves.push_back({column_of(history, x, file, "x"), column_of(history, y, file, "y"), names[k]});
  }
  const SceneUnits units(scene_text(folders.front()));
  const auto label = [&](const std::string& column) { return column == "time" ? units.time_name() : in_words(column); };
  // A scene with a unit of its own is not in SI.
  curves.x_label = labelled(label(x), options.unit ? "" : units.column(x));
  curves.y_label = labelled(label(y), options.unit.value_or(units.column(y)));
  curves.x_range = options.window ? range_text((*options.window)[0], (*options.window)[1]) : "[*:*]";
  curves.y_range = options.range    ? range_text((*options.range)[0], (*options.range)[1])
                   : options.window ? range_text((*options.window)[2], (*options.window)[3])
                                    : "[*:*]";
  curves.file = picture;
  run_gnuplot(curve_script(curves), picture);
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
  CurvePicture curve{{{x, y}}, body.title, labelled("x", body.length_unit), body.value_label, "[*:*]", "[*:*]", body.file};
  if (options.window) curve.x_range = range_text((*options.window)[0], (*options.window)[1]);
  if (options.range) curve.y_range = range_text(body.range[0], body.range[1]);
  else if (options.window) curve.y_range = range_text((*options.window)[2], (*options.window)[3]);
  return curve_script(curve);
}

/// Points that no bond joins to others, as far as the frame says.
std::vector<bool> lone_points(const hdf5::Source& source, const std::string& group, std::size_t points) {
  std::vector<bool> lone;
  if (source.contains(group + "/fragment")) {
    const std::vector<double> piece = source.read(group + "/fragment").data;
    std::map<double, std::size_t> count;
    for (const double number : piece) ++count[number];
    for (std::size_t p = 0; p < points; ++p) lone.push_back(count[piece[p]] == 1);
  } else if (source.contains(group + "/damage")) {
    for (const double damage : source.read(group + "/damage").data) lone.push_back(damage > 1 - 1e-9);
  }
  return lone;
}

/// The values of the points that a window shows. InputError where there are none.
std::vector<double> values_in(const std::array<double, 4>& window, const BodyPicture& body) {
  std::vector<double> shown;
  std::array<double, 4> all{INFINITY, -INFINITY, INFINITY, -INFINITY};
  for (std::size_t p = 0; p < body.values.size(); ++p) {
    const double x = body.drawn[3 * p], y = body.drawn[3 * p + 1];
    all = {std::min(all[0], x), std::max(all[1], x), std::min(all[2], y), std::max(all[3], y)};
    if (window[0] <= x && x <= window[1] && window[2] <= y && y <= window[3]) shown.push_back(body.values[p]);
  }
  if (shown.empty())
    throw InputError({}, "window", fmt::format("found a window without points; the body lies between {:.6g} and {:.6g} in x, {:.6g} and {:.6g} in y", all[0], all[1], all[2], all[3]));
  return shown;
}

void check_options(const PlotOptions& options) {
  if (options.window) {
    const auto& [left, right, bottom, top] = *options.window;
    if (!(left < right) || !(bottom < top)) throw InputError({}, "window", fmt::format("found {} {} {} {}; must be from x to a larger x and from y to a larger y", left, right, bottom, top));
  }
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
  FieldValues values = field_values(options.field, data.width(), data.data, options.component);
  if (const std::string path = group + "/" + dataset_of(options.field); source.has_attribute(path, "unit")) {
    const std::string unit = source.text(path, "unit");
    values.unit = unit == "-" ? "" : unit;
  }

  std::vector<double> drawn = position.data;
  if (options.deformed != 0) {
    const hdf5::Source::Array displacement = read_field(results, group, "displacement", points);
    for (std::size_t i = 0; i < drawn.size(); ++i) drawn[i] += options.deformed * displacement.data[i];
  }
  const std::string resolved = scene_text(results_folder(options.results.front()));
  const SceneUnits units(resolved.empty() ? source.text("/", "scene") : resolved);
  const std::string title = source.text("/", "title"), unit = options.unit ? "" : units.time();
  std::string what = fmt::format("frame {}, {} {:.6g}{}{}", frame, units.time_name(), source.real(group, "time"), unit.empty() ? "" : " ", unit);
  if (options.deformed != 0) what += fmt::format(", deformed {:g} times", options.deformed);
  BodyPicture body;
  body.dimension = dimension_of(position.data);
  body.reference = position.data;
  body.drawn = drawn;
  body.volume = volume.data;
  body.values = values.values;
  if (options.window && body.dimension == 3)
    throw InputError({}, "window", "found it with a solid body, which is seen from --view; must be of a body in a plane or on a line, or of curves");
  body.window = options.window;
  if (body.dimension > 1) body.lone = lone_points(source, group, points);
  body.range = options.range ? *options.range : range_of(options.window && body.dimension == 2 ? values_in(*options.window, body) : values.values);
  body.view = options.view;
  body.title = title.empty() ? what : title + ", " + what;
  body.value_label = labelled(values.label, options.unit.value_or(values.unit));
  body.length_unit = std::string(options.unit ? "" : "m");
  body.file = picture;
  run_gnuplot(body.dimension == 1 ? line_script(options, body) : body_script(body), picture);
}

}  // namespace

fs::path plot(const PlotOptions& options) {
  check_options(options);
  std::vector<fs::path> folders;
  for (const fs::path& results : options.results) folders.push_back(results_folder(results));
  if (folders.empty()) throw InputError({}, "results", "found none; must be the folder of a run");
  const bool history = options.field.starts_with(history_prefix);
  if (history || !options.x.empty() || !options.y.empty()) {
    const std::string x = options.x.empty() ? "time" : options.x, y = history ? options.field.substr(history_prefix.size()) : options.y;
    if (y.empty()) throw InputError({}, "y", fmt::format("found nothing over {}; must be a column of history.csv", x));
    const std::string name = fmt::format("history_{}{}{}.png", y, x == "time" ? "" : "_over_" + x, folders.size() > 1 ? "_of_runs" : "");
    const fs::path picture = options.output.empty() ? folders.front() / name : options.output;
    plot_curves(options, x, y, folders, picture);
    return picture;
  }
  if (folders.size() > 1) throw InputError({}, "results", fmt::format("found {} runs for the picture of a field; must be one; curves (--x, --y) may be of several", folders.size()));
  const ResultFile results(options.results.front());
  const std::int64_t frame = options.frame.value_or(results.frames().empty() ? 0 : results.frames().back());
  const std::string component = options.component.empty() ? "" : fmt::format("_{}", options.component);
  const fs::path picture =
      options.output.empty() ? folders.front() / fmt::format("{}{}_{}.png", dataset_of(options.field), component, frame_name(frame)) : options.output;
  plot_frame(options, results, frame, picture);
  return picture;
}

}  // namespace perikit
