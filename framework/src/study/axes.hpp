#pragma once
#include <string>

#include "study/study.hpp"

namespace perikit {

/// gnuplot's settings of title, labels, scales and tics of the study's picture: as wide as the numbers, and with labelled tics also where a
/// logarithmic axis covers less than a decade.
std::string axes(const StudyTable& table);

/// Where a logarithmic axis from `least` to `most` (positive) is labelled, at least twice; empty: every decade, as gnuplot does it.
std::vector<double> logarithmic_tics(double least, double most);

}  // namespace perikit
