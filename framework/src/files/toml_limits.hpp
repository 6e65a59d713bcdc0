#pragma once
/// Bounds of TOML texts. The reader of TOML and its tables call themselves once a level: a text that is deep enough ends the
/// program.

#include <cstddef>
#include <string>
#include <string_view>

namespace perikit {

inline constexpr std::size_t largest_toml = std::size_t{64} << 20;  // [bytes]: a set of some millions of points by number
inline constexpr int deepest_toml = 32;                             // names in a key, or brackets in each other; scenes need 4

/// Throws InputError with line and column where the text is larger or deeper. Sees strings and comments, and is no reader
/// otherwise.
void check_toml_limits(std::string_view text, const std::string& file, std::size_t largest = largest_toml);

}  // namespace perikit
