#pragma once
/// The table of point fields. What a scene may ask for, what the reference page says of it, how it is computed and how a picture is
/// labelled all come from here.

#include <string>
#include <string_view>
#include <vector>

#include "operators/samples.hpp"

namespace perikit {

class PointFields;

/// A point field in input order, float64: rows of 3 for vectors, 9 (row-major) for tensors, flat for scalars.
struct OutputField {
  std::string name;
  int width = 1;                       ///< 1, 3 or 9
  std::vector<double> data;            ///< width * points
  std::string unit{};                  ///< of what laws remember; that of other fields stands in the table
};

struct PointField {
  std::string name;
  int width;                                          ///< numbers per point: 1, 3 (vector) or 9 (tensor)
  bool of_shapes;                                     ///< made of shape tensors, which pair laws do not have
  Sampling samples;                                   ///< what is sampled for it
  std::string label, unit;                            ///< as pictures show them
  std::vector<double> (*compute)(PointFields& from);  ///< width * points
};

/// Of a row of so many numbers, in its order: "x" ... for vectors (as many as the body has dimensions; 0: 3), "xx" ... for tensors, none for scalars.
std::vector<std::string> field_components(int width, int dimension);

/// In the order of the documentation.
const std::vector<PointField>& point_fields();
std::vector<std::string> point_field_names();
/// Null for a name that is none.
const PointField* find_point_field(std::string_view name);

}  // namespace perikit
