#pragma once
/// Reads history.csv back.

#include <filesystem>
#include <string>
#include <vector>

namespace perikit {

struct History {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> values;  ///< [column][row]
};

/// Throws InputError where there is no header. A last line without its end is still being written and is left out.
History read_history(const std::filesystem::path& file);

}  // namespace perikit
