#pragma once
/// Parameters that stabilizations share.

#include "perikit/model/stabilization.hpp"
#include "perikit/plugin/parameters.hpp"

namespace perikit {

/// fit = "whole" | "linear": what is subtracted from each bond.
inline void add_penalty_fit(ParameterTable& table) {
  table.choice("fit", {"whole", "linear"},
               "what of the point gradient's fit is subtracted from each bond: all of it, so that polynomials up to its order store nothing, or its linear part "
               "alone; the same at order 1")
      .by_default("\"whole\"");
}

inline PenaltyFit penalty_fit(const ParameterValues& values) {
  return values.text("fit") == "linear" ? PenaltyFit::linear : PenaltyFit::whole;
}

}  // namespace perikit
