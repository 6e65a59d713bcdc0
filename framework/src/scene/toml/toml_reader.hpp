#pragma once
/// Reads typed values with their positions out of TOML, driven by parameter tables alone.

#include <toml++/toml.h>

#include <optional>

#include "perikit/plugin/part.hpp"
#include "scene/diagnostics.hpp"
#include "scene/expressions/expression.hpp"

namespace perikit {

/// A part's table with the keys that the framework adds to the scene's own kinematics (stabilization) and damage (no_fail, gradual), and to terms (set).
ParameterTable part_table(const PartDescription& description, Kind kind, const std::string& path);

class TomlReader {
 public:
  TomlReader(PartCatalogue& parts, std::string file) : parts_(parts), file_(std::move(file)) {}

  Diagnostics errors;
  Constants constants;  ///< known to expressions
  int dimension = 0;    ///< of the body; 0: not known, lengths are not checked

  SourcePosition position(const toml::source_region& source) const;
  SourcePosition position(const toml::node& node) const { return position(node.source()); }
  void refuse(const toml::node& node, const std::string& path, const std::string& message) {
    errors.add(position(node), path, message);
  }

  /// The values of `table`; an error for every unknown key, save for `others`, which the caller reads.
  ParameterValues read(const toml::table& table, const ParameterTable& parameters, const std::string& path,
                       const std::vector<std::string>& others = {}) {
    return read(table, position(table), parameters, path, others);
  }
  /// A part from its name or its table { type = "name", ... }; null after an error.
  std::shared_ptr<const PartValues> part(Kind kind, const toml::node& node, const std::string& path);
  /// A part of known type from its other keys. `type_path`, `at`: where the type stands.
  std::shared_ptr<const PartValues> part(Kind kind, const std::string& type, const toml::table& table, const std::string& path,
                                         const std::string& type_path, const SourcePosition& at);
  /// What an integer, or an expression that has the value of one, says; nothing, and no error, for all else.
  std::optional<std::int64_t> whole_number(const toml::node& node) const;
  /// One value; nothing after an error.
  std::optional<ParameterValue> value(const Parameter& parameter, const toml::node& node, const std::string& path);

 private:
  ParameterValues read(const toml::table& table, const SourcePosition& at, const ParameterTable& parameters,
                       const std::string& path, const std::vector<std::string>& others);
  void check_keys(const toml::table& table, const std::string& path, const std::vector<std::string>& known);
  /// Checks a group and returns the members whose default it has no room for.
  std::vector<std::string> check_group(const ParameterGroup& group, const ParameterTable& parameters, const toml::table& table,
                                       const SourcePosition& at, const std::string& path);
  void refuse_value(const Parameter& parameter, const toml::node& node, const std::string& path);
  /// Refuses what is no number, or none that is allowed. value: of an expression that has one.
  void refuse_number(const Parameter& parameter, const toml::node& node, const std::string& path, std::optional<double> value);
  /// A number, or the value of an expression in `constants`, which may be empty.
  std::optional<double> number(const Parameter& parameter, const toml::node& node, const std::string& path);
  std::optional<double> of_constants(const std::string& text, const toml::node& node, const std::string& path) const;
  std::optional<std::int64_t> integer(const Parameter& parameter, const toml::node& node, const std::string& path);
  std::optional<std::string> text(const Parameter& parameter, const toml::node& node, const std::string& path);
  std::optional<std::variant<double, std::string>> expression(const Parameter& parameter, const toml::node& node,
                                                              const std::string& path);
  template <class T, class ReadElement>
  std::optional<ParameterValue> list(const Parameter& parameter, const toml::node& node, const std::string& path,
                                     ReadElement element);

  PartCatalogue& parts_;
  std::string file_;
  std::optional<SourcePosition> default_position_;  ///< while a default is read: errors point at its table
};

/// What stands there, for messages: `the string "abc"`, `the integer 3`, `a table`.
std::string found(const toml::node& node);

/// `text` as TOML. Throws InputError with the position of a syntax error.
toml::table parse_toml(const std::string& text, const std::string& file);

}  // namespace perikit
