#pragma once
/// The lines of a study's plot.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "study/study.hpp"

namespace perikit {

struct StudySeries {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< in the order of the rows
  std::map<std::string, std::size_t> missing;     ///< rows without a point, by what they are: "failed", "refused", "without numbers"
};

/// The keys of which each combination of values is a line: those of plot.series, and, of all combinations (mode = "grid") over a key, every other key
/// that has several values.
std::vector<std::size_t> keys_of_series(const StudyTable& table);

/// Their names: what the lines are told apart by; empty where there is one line alone.
std::string series_title(const StudyTable& table);

/// A line for each combination of these, also where all its points are missing: rows without numbers (or, on a logarithmic axis, positive numbers).
std::vector<StudySeries> plotted_series(const StudyTable& table);

/// "from which x on y stays below the level", a row a series, the first to get there first.
std::string level_table(const StudyTable& table);

/// Observed orders: the exponent in error ~ key^order between neighbouring values of a key that takes positive numbers, a row for
/// each pair of runs that differ in nothing else. Of the key that the plot has as x, if it has one, else of all. Empty where
/// there are none.
std::string order_table(const StudyTable& table);

}  // namespace perikit
