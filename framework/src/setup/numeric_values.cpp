#include "setup/numeric_values.hpp"

namespace perikit {

NumericValues numeric_values(const PartValues& part, const Constants& constants, bool with_time) {
  NumericValues values;
  for (const std::string& key : part.values.keys()) {
    const ParameterValue* value = part.values.find(key);
    if (const auto* number = std::get_if<double>(value))
      values.emplace(key, Expression(*number));
    else if (const auto* text = std::get_if<std::string>(value); text && part.values.is_expression(key))
      values.emplace(key, Expression(*text, constants, with_time, part.values.position(key), part.values.path() + "." + key));
  }
  return values;
}

}  // namespace perikit
