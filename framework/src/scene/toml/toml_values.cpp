// Single values: types, ranges, lengths.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "scene/toml/toml_reader.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

bool in_range(const Parameter& p, double v) {
  return (p.lower_open ? v > p.lower : v >= p.lower) && (p.upper_open ? v < p.upper : v <= p.upper);
}

/// What one element of a list parameter may be.
Parameter element_of(const Parameter& list) {
  Parameter element = list;
  switch (list.type) {
    case ParameterType::numbers:
      element.type = ParameterType::number;
      break;
    case ParameterType::integers:
      element.type = ParameterType::integer;
      break;
    case ParameterType::expressions:
      element.type = ParameterType::expression;
      break;
    case ParameterType::components:
      element.type = ParameterType::component;
      break;
    case ParameterType::points:
      element.type = ParameterType::numbers;
      break;
    default:
      element.type = list.choices.empty() ? ParameterType::text : ParameterType::choice;
  }
  if (list.type == ParameterType::points) element.length(0, std::numeric_limits<std::size_t>::max());
  return element;
}

}  // namespace

void TomlReader::refuse_value(const Parameter& parameter, const toml::node& node, const std::string& path) {
  std::string hint;
  if (const auto* text = node.as_string(); text && !parameter.choices.empty())
    hint = did_you_mean(text->get(), parameter.choices);
  refuse(node, path, fmt::format("found {}; allowed: {}{}", found(node), allowed(parameter), hint));
}

std::optional<double> TomlReader::number(const Parameter& parameter, const toml::node& node, const std::string& path) {
  std::optional<double> number;  // toml++'s value<double>() would take more than these two
  if (const auto* v = node.as_floating_point()) number = v->get();
  if (const auto* v = node.as_integer()) number = static_cast<double>(v->get());
  if (const auto* v = node.as_string()) number = of_constants(v->get(), node, path);
  if (number && std::isfinite(*number) && in_range(parameter, *number)) return number;
  refuse_number(parameter, node, path, number);
  return std::nullopt;
}

std::optional<double> TomlReader::of_constants(const std::string& text, const toml::node& node, const std::string& path) const {
  try {
    const Expression expression(text, constants, false, position(node), path);
    return expression.depends_on_position() ? std::nullopt : std::optional(expression({}));
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::optional<std::int64_t> TomlReader::whole_number(const toml::node& node) const {
  if (const auto* v = node.as_integer()) return v->get();
  const auto* text = node.as_string();
  const std::optional<double> value = text ? of_constants(text->get(), node, "") : std::nullopt;
  if (!value) return std::nullopt;
  constexpr double most = 9007199254740992;  // 2^53: beyond it a double skips integers
  const double whole = std::round(*value);   // 3/0.1 is 30 but for rounding
  if (!(std::abs(whole) <= most) || std::abs(*value - whole) > 1e-12 * std::abs(whole)) return std::nullopt;
  return static_cast<std::int64_t>(whole);
}

std::optional<std::int64_t> TomlReader::integer(const Parameter& parameter, const toml::node& node, const std::string& path) {
  const std::optional<std::int64_t> number = whole_number(node);
  if (number && in_range(parameter, static_cast<double>(*number))) return number;
  const auto* text = node.as_string();
  refuse_number(parameter, node, path, text ? of_constants(text->get(), node, path) : std::nullopt);
  return std::nullopt;
}

void TomlReader::refuse_number(const Parameter& parameter, const toml::node& node, const std::string& path,
                               std::optional<double> value) {
  const bool text = node.is_string();
  refuse(node, path,
         fmt::format("found {}{}; allowed: {}{}", found(node), text && value ? fmt::format(" = {}", toml_number(*value)) : "",
                     allowed(parameter), text ? ", or an expression in [constants]" : ""));
}

std::optional<std::string> TomlReader::text(const Parameter& parameter, const toml::node& node, const std::string& path) {
  const auto& choices = parameter.choices;
  const auto chosen = [&](const std::string& text) {
    const std::string& prefix = parameter.choice_prefix;
    return choices.empty() || std::ranges::find(choices, text) != choices.end() || (!prefix.empty() && text.starts_with(prefix));
  };
  if (const auto* v = node.as_string(); v && chosen(v->get())) return v->get();
  refuse_value(parameter, node, path);
  return std::nullopt;
}

std::optional<std::variant<double, std::string>> TomlReader::expression(const Parameter& parameter, const toml::node& node,
                                                                        const std::string& path) {
  const auto* text = node.as_string();
  if (!text) {
    if (const auto value = number(parameter, node, path)) return *value;
    return std::nullopt;
  }
  if (parameter.type == ParameterType::component && text->get() == "free") return text->get();
  try {
    Expression(text->get(), constants, parameter.time, position(node), path);
  } catch (const InputError& error) {
    errors.add(position(node), error);
    return std::nullopt;
  }
  return text->get();
}

template <class T, class ReadElement>
std::optional<ParameterValue> TomlReader::list(const Parameter& parameter, const toml::node& node, const std::string& path,
                                               ReadElement element) {
  const toml::array* array = node.as_array();
  if (!array) {
    refuse_value(parameter, node, path);
    return std::nullopt;
  }
  const bool each_axis =
      parameter.type == ParameterType::components || (parameter.per_axis && parameter.type != ParameterType::points);
  const std::size_t size = array->size();
  if (each_axis && dimension > 0 && size != static_cast<std::size_t>(dimension)) {
    refuse(node, path,
           fmt::format("found a list of {}; allowed: a list of {}, one for each dimension of the body", size, dimension));
    return std::nullopt;
  }
  if (size < parameter.min_length || size > parameter.max_length) {
    refuse_value(parameter, node, path);
    return std::nullopt;
  }
  const Parameter one = element_of(parameter);
  std::vector<T> values;
  for (std::size_t i = 0; i < size; ++i) {
    if (auto read = element(one, *array->get(i), fmt::format("{}.{}", path, i))) values.push_back(std::move(*read));
  }
  if (values.size() != size) return std::nullopt;
  return ParameterValue(std::move(values));
}

std::optional<ParameterValue> TomlReader::value(const Parameter& p, const toml::node& node, const std::string& path) {
  const auto as_value = [](auto&& read) -> std::optional<ParameterValue> {
    if (!read) return std::nullopt;
    return ParameterValue(std::move(*read));
  };
  const auto one_number = [this](const auto&... at) { return number(at...); };
  const auto one_expression = [this](const auto&... at) { return expression(at...); };
  const auto read_expression = [&]() -> std::optional<ParameterValue> {
    const auto read = expression(p, node, path);
    if (!read) return std::nullopt;
    return std::visit([](const auto& v) { return ParameterValue(v); }, *read);
  };
  switch (p.type) {
    case ParameterType::number:
      return as_value(number(p, node, path));
    case ParameterType::integer:
      return as_value(integer(p, node, path));
    case ParameterType::text:
    case ParameterType::choice:
      return as_value(text(p, node, path));
    case ParameterType::expression:
    case ParameterType::component:
      return read_expression();
    case ParameterType::expressions:
    case ParameterType::components:
      return list<std::variant<double, std::string>>(p, node, path, one_expression);
    case ParameterType::numbers:
      return list<double>(p, node, path, one_number);
    case ParameterType::integers:
      return list<std::int64_t>(p, node, path, [this](const auto&... at) { return integer(at...); });
    case ParameterType::texts:
      return list<std::string>(p, node, path, [this](const auto&... at) { return text(at...); });
    case ParameterType::points:
      return list<std::vector<double>>(p, node, path, [&](const Parameter& point, const toml::node& at, const std::string& key) {
        auto read = list<double>(point, at, key, one_number);
        return read ? std::optional(std::get<std::vector<double>>(std::move(*read))) : std::nullopt;
      });
    case ParameterType::part: {
      auto read = part(p.kind, node, path);
      return read ? std::optional<ParameterValue>(std::move(read)) : std::nullopt;
    }
    case ParameterType::boolean:
      if (const auto* v = node.as_boolean()) return ParameterValue(v->get());
      refuse_value(p, node, path);
  }
  return std::nullopt;
}

}  // namespace perikit
