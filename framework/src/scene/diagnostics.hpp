#pragma once
/// Collects every error of an input, so that one run of the program reports them all.

#include <string>
#include <string_view>
#include <vector>

#include "perikit/core/errors.hpp"

namespace perikit {

/// Stands as the file of values that --set gave.
inline const std::string command_line = "command line";

class Diagnostics {
 public:
  void add(SourcePosition position, std::string_view key, std::string_view message);
  /// An error that already carries its place in its text.
  void add(SourcePosition position, const InputError& error);
  bool empty() const noexcept { return entries_.empty(); }
  /// Throws InputErrors, sorted by position (the command line last), if there is any.
  void raise() const;

 private:
  struct Entry {
    SourcePosition position;
    std::string text;
  };
  std::vector<Entry> entries_;
};

/// "section.key", or "key" at the top level.
std::string join_path(const std::string& path, std::string_view key);

}  // namespace perikit
