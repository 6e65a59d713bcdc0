#pragma once
/// Point fields of what laws remember: "state:NAME" for every variable that a law names (StateVariable of perikit/model/material.hpp).

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "perikit/model/material.hpp"

namespace perikit {

inline constexpr std::string_view state_prefix = "state:";
inline bool names_state(std::string_view field) noexcept { return field.starts_with(state_prefix); }
/// The name of the variable in the name of its field.
inline std::string_view variable_of(std::string_view field) noexcept { return field.substr(state_prefix.size()); }

/// Files hold fields by names without a colon, which separates file and dataset in XDMF: "state_NAME".
std::string dataset_of(std::string field);
/// The field of a dataset.
std::string field_of(std::string dataset);

struct StateField {
  std::string name;    ///< with its prefix
  std::string unit;    ///< "-" without one
  int components = 1;  ///< numbers that the law keeps: 1, or those of a symmetric or full tensor of the space
  int width = 1;       ///< numbers of a row: 1, or 9 row by row; 0: two laws of the body mean different things by this name
};

/// Of the laws of a body, each name once. Variables of another number of components are no fields.
std::vector<StateField> state_fields(std::span<const Material* const> laws, Space space);
/// "number", "symmetric tensor", "tensor", or so many numbers: what a variable is in this space.
std::string shape_of(const StateVariable& variable, Space space);
/// row[9] <- a symmetric or full tensor of the space.
void write_row(Space space, std::span<const double> components, double* row) noexcept;

}  // namespace perikit
