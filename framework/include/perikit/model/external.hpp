#pragma once
/// Variables that laws read beside deformation and memory, and that something else knows, as temperatures.

#include <string_view>

#include "perikit/core/field.hpp"

namespace perikit {

/// One that a law reads.
struct ExternalVariable {
  std::string_view name;   ///< lower case and underscores
  std::string_view unit;   ///< "-" without one
  double reference = 0;    ///< its value where nobody gives one, and where stable steps are estimated
};

/// One that is given to an evaluation. Names that no law reads mean nothing.
struct ExternalValue {
  std::string_view name;
  double value = 0;         ///< the same everywhere, or:
  ConstFieldView field{};   ///< of one component, by point, of other ranks and images too. At the evaluation point of a bond counts the mean of both ends
};

}  // namespace perikit
