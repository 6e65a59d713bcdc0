#pragma once
/// Writes checked values back as TOML: every default shown, always in the order of the tables.

#include <string>

#include "perikit/plugin/part.hpp"

namespace perikit {

class ResolvedWriter {
 public:
  explicit ResolvedWriter(PartCatalogue& parts) : parts_(parts) {}
  /// "[name]" or "[[name]]".
  void header(const std::string& name, bool array = false);
  void line(const std::string& key, const std::string& toml);
  /// One line per value, in the order of `parameters`.
  void lines(const ParameterTable& parameters, const ParameterValues& values);
  /// A section of its own for a part at the top level.
  void part(const PartValues& part);
  std::string inline_table(const ParameterTable& parameters, const ParameterValues& values, const std::string& type = {});
  const std::string& text() const noexcept { return text_; }

 private:
  std::string value(const ParameterValue& value);

  PartCatalogue& parts_;
  std::string text_;
};

}  // namespace perikit
