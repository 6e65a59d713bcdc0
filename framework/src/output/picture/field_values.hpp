#pragma once
/// One number per point from a field and the name of a component.

#include <span>
#include <string>
#include <vector>

namespace perikit {

struct FieldValues {
  std::vector<double> values;  ///< one per point
  std::string label;           ///< "displacement, x"
  std::string unit;            ///< SI unit of known fields, else empty
};

/// `data`: rows of `width` (1, 3 or 9). An empty component means the usual one (PlotOptions). Throws InputError naming the
/// components.
FieldValues field_values(const std::string& field, int width, std::span<const double> data, const std::string& component);

/// SI unit of a point field; empty for what has none and for unknown ones.
std::string field_unit(const std::string& field);

}  // namespace perikit
