#include "output_fields/state_field.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace perikit {

namespace {

constexpr std::string_view dataset_prefix = "state_";

/// Symmetric tensors of a space: pack_symmetric of perikit/sdk/history.hpp.
int symmetric_components(Space space) noexcept { return dimension(space) == 3 ? 6 : dimension(space) == 2 ? 4 : 3; }

bool is_tensor(int components, Space space) noexcept { return components == symmetric_components(space) || components == tensor_components(space); }

}  // namespace

std::string dataset_of(std::string field) {
  if (names_state(field)) field.replace(0, state_prefix.size(), dataset_prefix);
  return field;
}

std::string field_of(std::string dataset) {
  if (dataset.starts_with(dataset_prefix)) dataset.replace(0, dataset_prefix.size(), state_prefix);
  return dataset;
}

std::vector<StateField> state_fields(std::span<const Material* const> laws, Space space) {
  std::vector<StateField> fields;
  for (const Material* const law : laws)
    for (const StateVariable& variable : law->state(space)) {
      const bool tensor = is_tensor(variable.components, space);
      if (variable.components != 1 && !tensor) continue;
      StateField field{fmt::format("{}{}", state_prefix, variable.name), std::string(variable.unit), variable.components, tensor ? 9 : 1};
      const auto known = std::ranges::find(fields, field.name, &StateField::name);
      if (known == fields.end()) fields.push_back(std::move(field));
      else if (known->unit != field.unit || known->components != field.components) known->width = 0;
    }
  return fields;
}

std::string shape_of(const StateVariable& variable, Space space) {
  if (variable.components == 1) return "number";
  if (variable.components == symmetric_components(space)) return "symmetric tensor";
  return variable.components == tensor_components(space) ? "tensor" : fmt::format("{} numbers, which are no field", variable.components);
}

void write_row(Space space, std::span<const double> components, double* row) noexcept {
  const int d = dimension(space), all = tensor_components(space);
  const bool full = static_cast<int>(components.size()) == all;
  std::fill_n(row, 9, 0.0);
  std::size_t next = 0;
  for (int c = 0; c < all; ++c) {
    const int i = c < d * d ? c / d : d + c - d * d, j = c < d * d ? c % d : i;
    if (!full && i > j) continue;
    row[3 * i + j] = components[next++];
    if (!full) row[3 * j + i] = row[3 * i + j];
  }
}

}  // namespace perikit
