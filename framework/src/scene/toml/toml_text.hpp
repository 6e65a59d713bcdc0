#pragma once
#include <string>
#include <string_view>

namespace perikit {

/// A basic string with its quotes, escaped as TOML wants it.
std::string toml_string(std::string_view text);
/// The text, or its beginning and "..." where it is long; never cuts a UTF-8 character.
std::string excerpt(const std::string& text);
/// The shortest float that reads back as the same double.
std::string toml_number(double value);
/// A bare key where that is allowed, else a quoted one.
std::string toml_key(std::string_view key);

}  // namespace perikit
