#pragma once
/// The lines of a study's plot.

#include <string>
#include <utility>
#include <vector>

#include "perikit/run/study.hpp"

namespace perikit {

struct StudySeries {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< in the order of the rows
};

/// By the values of plot.series. Rows without numbers (or, on a logarithmic axis, positive numbers) are left out.
std::vector<StudySeries> plotted_series(const StudyTable& table);

/// "from which x on y stays below the level", a row a series, the first to get there first.
std::string level_table(const StudyTable& table);

/// Observed orders: the exponent in error ~ key^order between neighbouring values of a key that takes positive numbers, a row for
/// each pair of runs that differ in nothing else. Of the key that the plot has as x, if it has one, else of all. Empty where
/// there are none.
std::string order_table(const StudyTable& table);

}  // namespace perikit
