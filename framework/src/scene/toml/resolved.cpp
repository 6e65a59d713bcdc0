#include "scene/toml/resolved.hpp"

#include <fmt/format.h>

#include "scene/toml/toml_reader.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

std::string scalar(double v) {
  return toml_number(v);
}
std::string scalar(std::int64_t v) {
  return fmt::format("{}", v);
}
std::string scalar(bool v) {
  return v ? "true" : "false";
}
std::string scalar(const std::string& v) {
  return toml_string(v);
}
std::string scalar(const std::variant<double, std::string>& v) {
  return std::visit([](const auto& one) { return scalar(one); }, v);
}

template <class T>
std::string scalar(const std::vector<T>& list) {
  std::string text;
  for (const T& element : list) text += (text.empty() ? "" : ", ") + scalar(element);
  return "[" + text + "]";
}

}  // namespace

void ResolvedWriter::header(const std::string& name, bool array) {
  text_ += array ? fmt::format("\n[[{}]]\n", name) : fmt::format("\n[{}]\n", name);
}

void ResolvedWriter::line(const std::string& key, const std::string& toml) {
  text_ += fmt::format("{} = {}\n", toml_key(key), toml);
}

void ResolvedWriter::lines(const ParameterTable& parameters, const ParameterValues& values) {
  for (const Parameter& parameter : parameters.parameters()) {
    if (const ParameterValue* v = values.find(parameter.name)) line(parameter.name, value(*v));
  }
}

void ResolvedWriter::part(const PartValues& part) {
  const std::string section(name(part.kind));
  header(section, part.kind == Kind::term);
  line("type", toml_string(part.type));
  lines(part_table(parts_.describe(part.kind, part.type), part.kind, section), part.values);
}

std::string ResolvedWriter::inline_table(const ParameterTable& parameters, const ParameterValues& values,
                                         const std::string& type) {
  std::string text = type.empty() ? "" : "type = " + toml_string(type);
  for (const Parameter& parameter : parameters.parameters()) {
    const ParameterValue* v = values.find(parameter.name);
    if (v) text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", toml_key(parameter.name), value(*v));
  }
  return "{ " + text + " }";
}

std::string ResolvedWriter::value(const ParameterValue& value) {
  if (const auto* part = std::get_if<std::shared_ptr<const PartValues>>(&value)) {
    return inline_table(parts_.describe((*part)->kind, (*part)->type).parameters, (*part)->values, (*part)->type);
  }
  return std::visit(
      [](const auto& v) -> std::string {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::shared_ptr<const PartValues>>)
          return {};
        else
          return scalar(v);
      },
      value);
}

}  // namespace perikit
