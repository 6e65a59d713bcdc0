#include "study/study.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "files/atomic_file.hpp"
#include "output/history_file.hpp"
#include "output/recorder.hpp"
#include "run/output_folder.hpp"
#include "run/processes.hpp"
#include "run/simulation.hpp"
#include "scene/diagnostics.hpp"
#include "study/plot.hpp"
#include "study/study.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

/// A combination, read but not run. Without a scene the row already says why.
struct Planned {
  std::optional<Scene> scene;
  std::vector<double> references;  ///< one for each quantity; 0: none
  StudyRow row;
};

double reference_of(const StudyQuantity& quantity, const Scene& scene) {
  if (!quantity.reference) return 0;
  const std::string key = quantity.path + ".reference";
  const Expression expression(*quantity.reference, scene.constants, false, quantity.reference_position, key);
  if (expression.depends_on_position()) {
    throw InputError(quantity.reference_position, key,
                     "found an expression in x, y or z; allowed: one in the constants of the scene");
  }
  const double value = expression({});
  if (value == 0)
    throw InputError(quantity.reference_position, key, "found the value 0; allowed: any other, since errors are relative to it");
  return value;
}

void check_source(const StudyQuantity& quantity, const Scene& scene) {
  std::vector<std::string> known = history_columns(scene, true);
  known.insert(known.end(), run_measures().begin(), run_measures().end());
  if (std::ranges::find(known, quantity.from) != known.end()) return;
  throw InputError(
      quantity.from_position, quantity.path + ".from",
      fmt::format("found \"{}\"; allowed: {}{}", quantity.from, fmt::join(known, ", "), did_you_mean(quantity.from, known)));
}

/// Errors of a value come from the command line, as the scene reader sees it: they are shown where the study has its list.
std::string placed(std::string message, const Study& study) {
  for (const StudyKey& key : study.keys) {
    const std::string seen = fmt::format("{}: {}:", command_line, key.key);
    const SourcePosition& at = key.position;
    for (std::size_t i; (i = message.find(seen)) != std::string::npos;) {
      message.replace(i, seen.size(), fmt::format("{}:{}:{}: values.{}:", at.file, at.line, at.column, key.key));
    }
  }
  return message;
}

/// A value that is an expression is a number, too, once the constants of the scene are known: pictures place it by it.
void evaluate(StudyValue& value, const Scene& scene) {
  if (value.number || !value.toml.starts_with('"')) return;
  try {
    const Expression expression(value.shown, scene.constants, false, {}, "");
    if (!expression.depends_on_position()) value.number = expression({});
  } catch (const InputError&) {  // the name of a part, say
  }
}

Planned plan(const Study& study, const std::vector<std::size_t>& combination, PartCatalogue& parts, SceneOptions options) {
  Planned planned;
  for (std::size_t k = 0; k < study.keys.size(); ++k) {
    planned.row.values.push_back(study.keys[k].values[combination[k]]);
    options.overrides.push_back(fmt::format("{}={}", study.keys[k].key, planned.row.values.back().toml));
  }
  planned.row.quantities.resize(study.quantities.size());
  planned.row.errors.resize(study.quantities.size());
  try {
    planned.scene = read_scene(study.scene, parts, options);
  } catch (const InputError& error) {
    planned.row.status = "refused";
    planned.row.reason = placed(error.what(), study);
    return planned;
  }
  for (StudyValue& value : planned.row.values) evaluate(value, *planned.scene);
  for (const StudyQuantity& quantity : study.quantities) {
    check_source(quantity, *planned.scene);
    planned.references.push_back(reference_of(quantity, *planned.scene));
  }
  return planned;
}

/// Reads the scene of every combination; of many, says so from the start.
std::vector<Planned> plan_all(const Study& study, PartCatalogue& parts, const SceneOptions& options, const std::function<void(const std::string&)>& progress) {
  std::vector<Planned> runs;
  const auto all = combinations(study);
  auto told = std::chrono::steady_clock::now();
  if (all.size() > 200) progress(fmt::format("{} combinations; reading their scenes", all.size()));
  for (const auto& combination : all) {
    runs.push_back(plan(study, combination, parts, options));
    if (stop_requested()) throw RunError("stopped by a signal before the first run");
    if (std::chrono::steady_clock::now() - told < std::chrono::seconds(5)) continue;
    told = std::chrono::steady_clock::now();
    progress(fmt::format("{} of {} scenes read", runs.size(), all.size()));
  }
  if (std::ranges::none_of(runs, [](const Planned& run) { return run.scene.has_value(); })) {
    throw InputError(
        {study.file.string()}, "values",
        fmt::format("none of the {} combinations makes a scene; the first: {}", runs.size(), runs.front().row.reason));
  }
  return runs;
}

double reduced(const std::vector<double>& values, const std::string& reduce) {
  if (reduce == "max") return *std::ranges::max_element(values);
  if (reduce == "min") return *std::ranges::min_element(values);
  if (reduce == "mean") return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return values.back();
}

std::optional<double> measured(const StudyQuantity& quantity, const RunOutcome& outcome, const History& history) {
  const auto column = std::ranges::find(history.columns, quantity.from);
  if (column != history.columns.end()) {
    const auto& values = history.values[static_cast<std::size_t>(column - history.columns.begin())];
    return values.empty() ? std::nullopt : std::optional(reduced(values, quantity.reduce));
  }
  const auto measure = outcome.measures.find(quantity.from);
  return measure == outcome.measures.end() ? std::nullopt : std::optional(measure->second);
}

void fill(StudyRow& row, const Study& study, const RunOutcome& outcome, const std::vector<double>& references,
          const fs::path& folder) {
  row.status = outcome.status;
  row.reason = outcome.reason;
  if (outcome.status != "done") return;
  const History history = read_history(folder / "history.csv");
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    row.quantities[q] = measured(study.quantities[q], outcome, history);
    if (references[q] != 0 && row.quantities[q])
      row.errors[q] = std::abs(*row.quantities[q] - references[q]) / std::abs(references[q]);
  }
}

/// Lines go from left to right where the axis is a key of the values; where it is a result (run time), from run to run.
StudyTable in_order_of_axis(StudyTable table) {
  const std::string& x = table.study.plot->x;
  if (std::ranges::find(table.study.keys, x, &StudyKey::key) == table.study.keys.end()) return table;
  std::ranges::stable_sort(table.rows, {}, [&](const StudyRow& row) { return table.number(row, x).value_or(INFINITY); });
  return table;
}

/// Of an earlier run in this folder; empty where there was none.
std::string resolved_scene(const fs::path& folder) {
  const auto marked = read_marked(folder / "scene.toml");
  return marked ? marked->text : std::string();
}

}  // namespace

std::string described(const Study& study, const StudyRow& row) {
  std::vector<std::string> texts;
  for (std::size_t k = 0; k < study.keys.size(); ++k)
    texts.push_back(fmt::format("{} = {}", study.keys[k].key, row.values[k].toml));
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string unfinished_runs(const StudyTable& table) {
  std::string runs;
  std::size_t count = 0;
  for (const StudyRow& row : table.rows) {
    if (row.status == "done") continue;
    ++count;
    runs += fmt::format("\n  runs/{} ({}) {}: {}", row.run, described(table.study, row), row.status, row.reason.substr(0, row.reason.find('\n')));
  }
  return count == 0 ? runs : fmt::format("{} of {} runs of the study did not come to their end:{}", count, table.rows.size(), runs);
}

std::vector<std::vector<std::size_t>> combinations(const Study& study) {
  std::vector<std::vector<std::size_t>> all;
  if (study.zip) {
    for (std::size_t i = 0; i < study.keys.front().values.size(); ++i) all.emplace_back(study.keys.size(), i);
    return all;
  }
  all.emplace_back();
  for (const StudyKey& key : study.keys) {
    std::vector<std::vector<std::size_t>> longer;
    for (const auto& combination : all) {
      for (std::size_t i = 0; i < key.values.size(); ++i) {
        longer.push_back(combination);
        longer.back().push_back(i);
      }
    }
    all = std::move(longer);
  }
  return all;
}

StudyTable run_study(const Study& study, PartCatalogue& parts, const SceneOptions& options, const fs::path& folder,
                     const StudyRunner& run, const std::function<void(const std::string&)>& progress, const StudyExecution& how) {
  std::vector<Planned> runs = plan_all(study, parts, options, progress);
  const OutputFolder output(folder, {.marker = "study.toml",
                                     .names = {"study.toml", "table.csv", "table.md", "plot.png", "plot.svg", "runs"},
                                     .inputs = {study.file, study.scene},
                                     .own = false,
                                     .force = how.force});
  output.mark(read_text(study.file));
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i].row.run = i;
  const auto own = [&](std::size_t i) { return folder / "runs" / fmt::format("{}", i); };
  std::vector<bool> ended(runs.size(), false);
  StudyTable table{study, {}};
  const auto write_table = [&] {
    table.rows.clear();
    for (std::size_t i = 0; i < runs.size(); ++i)
      if (ended[i]) table.rows.push_back(runs[i].row);
    write_file_atomically(folder / "table.csv", table.csv());
    write_file_atomically(folder / "table.md", table.markdown());
  };
  const auto end = [&](std::size_t i, const std::string& note) {
    StudyRow& row = runs[i].row;
    ended[i] = true;
    progress(fmt::format("run {} {}{}{}{}", i + 1, row.status, note, row.reason.empty() ? "" : ": ", row.reason));
    write_table();
  };
  const auto take = [&](std::size_t i, const RunOutcome& outcome) { fill(runs[i].row, study, outcome, runs[i].references, own(i)); };
  Processes processes;
  const auto collect = [&] {
    const std::size_t i = processes.wait();
    const auto outcome = kept_outcome(own(i));
    take(i, outcome ? *outcome : RunOutcome{"failed", "its process left no outcome", {}});
    end(i, "");
  };
  for (std::size_t i = 0; i < runs.size() && !stop_requested(); ++i) {
    progress(fmt::format("run {} of {} (runs/{}): {}", i + 1, runs.size(), i, described(study, runs[i].row)));
    if (!runs[i].scene) {
      end(i, "");
      continue;
    }
    const bool same = how.resume && resolved_scene(own(i)) == runs[i].scene->resolved;
    if (const auto kept = same ? kept_outcome(own(i)) : std::nullopt; kept && kept->status == "done") {
      take(i, *kept);
      end(i, " before");
      continue;
    }
    const auto work = [&run, &scene = *runs[i].scene, path = own(i)] {
      remove_file(path / "outcome.txt");
      const RunOutcome outcome = run(scene, path);
      keep_outcome(path, outcome);
      return outcome;
    };
    if (how.jobs > 1) {
      processes.start(i, work);
      if (processes.running() == static_cast<std::size_t>(how.jobs)) collect();
    } else {
      take(i, work());
      end(i, "");
    }
  }
  while (processes.running() > 0) collect();
  if (stop_requested()) {
    throw RunError(fmt::format("stopped by a signal; {} of {} runs are in {}", table.rows.size(), runs.size(), (folder / "table.csv").string()));
  }
  if (study.plot && std::ranges::any_of(table.rows, [](const StudyRow& row) { return row.status == "done"; })) {
    const StudyTable drawn = in_order_of_axis(table);
    for (const char* picture : {"plot.png", "plot.svg"}) draw(drawn, folder / picture);
  }
  return table;
}

}  // namespace perikit
