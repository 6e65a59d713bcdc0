#pragma once
/// Parameter studies: one scene, lists of values for some of its keys, one run for each combination, a table and a picture.
///
///   format = 1
///   scene = "bar.toml"                       # relative to this file
///   mode = "grid"                            # every combination, the first key slowest; "zip": the lists side by side
///   [values]
///   kinematics.type = ["conventional", "baqp"]
///   body.lattice.spacing = [0.1, 0.05]
///   [[quantity]]
///   name = "tip"
///   from = "tip_uy"                          # a column of history.csv, or one of run_measures()
///   reduce = "last"                          # over the rows of the history: last, max, min, mean
///   reference = "P * L^3 / (3 * E * I)"      # a number or an expression in the scene's [constants]: gives the column tip_error
///   [plot]
///   x = "cost"                               # columns of the table
///   y = "tip_error"
///   series = "kinematics.type"               # a line for each of its values; "kinematics.type, material.type": for each combination
///   log = "xy"
///   level = 0.01                             # a line at this y, and in table.md from which x on each series stays below it

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "perikit/core/errors.hpp"
#include "scene/scene.hpp"

namespace perikit {

struct StudyValue {
  std::string toml;              ///< as --set takes it
  std::string shown;             ///< as the table shows it: strings without quotes
  std::optional<double> number;  ///< where it is one
};

/// A dotted key of the scene and the values it takes.
struct StudyKey {
  std::string key;
  std::vector<StudyValue> values;
  SourcePosition position;
};

struct StudyQuantity {
  std::string name, from, reduce;
  std::optional<std::variant<double, std::string>> reference;
  SourcePosition from_position, reference_position;
  std::string path;  ///< "quantity.0", for messages
  std::string error_column() const { return name + "_error"; }
};

struct StudyPlot {
  std::string x, y;
  std::vector<std::string> series;  ///< keys of the values, of which each combination is a line; see plotted_series
  std::string log;     ///< axes with a logarithmic scale: "", "x", "y", "xy"
  std::optional<double> level;   ///< of y
};

struct Study {
  std::filesystem::path file, scene;
  std::string title;
  bool zip = false;
  std::vector<StudyKey> keys;  ///< in the order of the file
  std::vector<StudyQuantity> quantities;
  std::optional<StudyPlot> plot;
};

/// Throws InputErrors with every error found, as read_scene does. The scene itself is read by run_study.
Study read_study(const std::filesystem::path& file, PartCatalogue& parts);
/// The same from memory; `file` is used in messages and for relative paths.
Study parse_study(const std::string& text, const std::filesystem::path& file, PartCatalogue& parts);

/// The keys of a study by section ("" for the top level, "quantity", "plot"), for `describe` and the reference page. [values] has the
/// keys of the scene.
const std::vector<std::pair<std::string, ParameterTable>>& study_sections();

/// For each run the index of the value of each key.
std::vector<std::vector<std::size_t>> combinations(const Study& study);

/// What a run itself knows besides its history: run_time [s] (with its output), cpu_time [s] (processor time of that, all threads
/// together: on a busy machine too), set_up_time [s], steps, points, bonds, memory [bytes].
const std::vector<std::string>& run_measures();

struct RunOutcome {
  std::string status;  ///< "done"; "failed": it ended early; "refused": an input error
  std::string reason;  ///< empty when done
  std::map<std::string, double> measures;
};

/// Runs one scene into a folder and never throws.
using StudyRunner = std::function<RunOutcome(const Scene& scene, const std::filesystem::path& folder)>;
/// force: what perikit did not write in the folder is replaced all the same.
RunOutcome run_here(const Scene& scene, const PartFactory& parts, const std::filesystem::path& folder, bool force = false);
/// The same in a process of its own, which may crash or run out of memory without harm. The calling process must not have
/// computed in parallel before: a copied process has none of the threads.
RunOutcome run_in_child(const Scene& scene, const PartFactory& parts, const std::filesystem::path& folder, bool force = false);

/// The outcome of a run in its folder; nothing where the run came to no end.
void keep_outcome(const std::filesystem::path& folder, const RunOutcome& outcome);
std::optional<RunOutcome> kept_outcome(const std::filesystem::path& folder);

struct StudyExecution {
  int jobs = 1;         ///< runs side by side; more than one disturbs what is measured in seconds
  bool resume = false;  ///< keep the runs that are done already
  bool force = false;   ///< replace what perikit did not write in the folder
};

struct StudyRow {
  std::size_t run = 0;                                    ///< index among the combinations
  std::vector<StudyValue> values;                         ///< one for each key
  std::vector<std::optional<double>> quantities, errors;  ///< one for each quantity; errors: |quantity - reference| / |reference|
  std::string status, reason;
};

struct StudyTable {
  Study study;
  std::vector<StudyRow> rows;

  /// The number in a column named as in the header; nothing where there is none.
  std::optional<double> number(const StudyRow& row, const std::string& column) const;
  /// Header and one line a run, 17 significant digits, quoted where need be.
  std::string csv() const;
  std::string markdown() const;
};

/// "kinematics.type = "baqp", n = 4": the values of a run.
std::string described(const Study& study, const StudyRow& row);
/// The runs that failed or were refused, with their number, their values and the reason, a line each; empty where all are done.
std::string unfinished_runs(const StudyTable& table);

/// From which x on the points (x, y) of a series stay at or below a level of y, interpolated on a straight line (of logarithms where both
/// axes have them).
struct Crossing {
  double x = 0;
  enum class Kind {
    reached,   ///< at x
    at_once,   ///< by all points, the first of them at x
    never,     ///< the last point, at x, is above
  } kind = Kind::never;
};
Crossing crossing(std::vector<std::pair<double, double>> points, double level, bool logarithmic);

/// Runs every combination into folder/runs/<index>, `jobs` at a time, and writes folder/table.csv and table.md after each, and
/// folder/plot.png and plot.svg at the end where the study wants one. A combination that is refused or fails gives a row that says so.
/// options: for every run; `progress` gets a line before and after each.
/// Throws InputError where no combination makes a scene, or a quantity or reference does not fit a scene - before the first run;
/// RunError where a file cannot be written, or request_stop was called (the rows so far are kept).
StudyTable run_study(const Study& study, PartCatalogue& parts, const SceneOptions& options, const std::filesystem::path& folder,
                     const StudyRunner& run, const std::function<void(const std::string&)>& progress, const StudyExecution& how = {});

}  // namespace perikit
