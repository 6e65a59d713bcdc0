#include <fmt/format.h>

#include <stdexcept>

#include "perikit/plugin/parameters.hpp"

namespace perikit {

namespace {

std::string joined(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

/// The value as T; a part that asks for a key its table does not declare so is at fault, not the user.
template <class T>
const T& get(const ParameterValues& values, std::string_view key) {
  const ParameterValue* value = values.find(key);
  if (!value) throw std::logic_error(fmt::format("parameter '{}' has no value", joined(values.path(), key)));
  const T* typed = std::get_if<T>(value);
  if (!typed)
    throw std::logic_error(fmt::format("parameter '{}' is read as another type than declared", joined(values.path(), key)));
  return *typed;
}

}  // namespace

const ParameterValue* ParameterValues::find(std::string_view key) const noexcept {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second.value;
}

bool ParameterValues::has(std::string_view key) const noexcept {
  return find(key) != nullptr;
}

bool ParameterValues::given(std::string_view key) const noexcept {
  const auto found = entries_.find(key);
  return found != entries_.end() && found->second.given;
}

double ParameterValues::number(std::string_view key) const {
  const ParameterValue* value = find(key);
  if (value && std::holds_alternative<std::int64_t>(*value)) return static_cast<double>(std::get<std::int64_t>(*value));
  if (value && std::holds_alternative<std::string>(*value)) throw error(key, "found an expression; allowed here: a number");
  return get<double>(*this, key);
}
std::int64_t ParameterValues::integer(std::string_view key) const {
  return get<std::int64_t>(*this, key);
}
bool ParameterValues::boolean(std::string_view key) const {
  return get<bool>(*this, key);
}
const std::string& ParameterValues::text(std::string_view key) const {
  return get<std::string>(*this, key);
}
const std::vector<double>& ParameterValues::numbers(std::string_view key) const {
  return get<std::vector<double>>(*this, key);
}
const std::vector<std::int64_t>& ParameterValues::integers(std::string_view key) const {
  return get<std::vector<std::int64_t>>(*this, key);
}
const std::vector<std::string>& ParameterValues::texts(std::string_view key) const {
  return get<std::vector<std::string>>(*this, key);
}
const std::vector<std::vector<double>>& ParameterValues::points(std::string_view key) const {
  return get<std::vector<std::vector<double>>>(*this, key);
}
std::variant<double, std::string> ParameterValues::expression(std::string_view key) const {
  const ParameterValue* value = find(key);
  if (value && std::holds_alternative<std::string>(*value)) return std::get<std::string>(*value);
  return number(key);
}
const std::vector<std::variant<double, std::string>>& ParameterValues::expressions(std::string_view key) const {
  return get<std::vector<std::variant<double, std::string>>>(*this, key);
}
std::shared_ptr<const PartValues> ParameterValues::shared_part(std::string_view key) const {
  return get<std::shared_ptr<const PartValues>>(*this, key);
}
const PartValues& ParameterValues::part(std::string_view key) const {
  return *get<std::shared_ptr<const PartValues>>(*this, key);
}

SourcePosition ParameterValues::position(std::string_view key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() ? table_position_ : found->second.position;
}

InputError ParameterValues::error(std::string_view key, std::string_view message) const {
  return InputError(position(key), joined(path_, key), message);
}

void ParameterValues::set(std::string key, ParameterValue value, SourcePosition position, bool given) {
  entries_.insert_or_assign(std::move(key), Entry{std::move(value), std::move(position), given});
}

void ParameterValues::mark_expression(std::string_view key) { entries_.find(key)->second.expression = true; }

bool ParameterValues::is_expression(std::string_view key) const noexcept {
  const auto entry = entries_.find(key);
  return entry != entries_.end() && entry->second.expression;
}

std::vector<std::string> ParameterValues::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, entry] : entries_)
    if (key != "type") names.push_back(key);
  return names;
}

}  // namespace perikit
