#pragma once
#include <optional>

#include "commands.hpp"

namespace perikit::app {

/// Reads the words of the command line into `options`. Where that is all there is to do (help, version, words that were refused, which it
/// then says), the program's exit status.
std::optional<int> read_command_line(int argc, char** argv, Options& options);

}  // namespace perikit::app
