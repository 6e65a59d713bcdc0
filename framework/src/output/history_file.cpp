#include "output/history_file.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "perikit/core/errors.hpp"

namespace perikit {

History read_history(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line, cell;
  if (!std::getline(stream, line)) throw InputError({file.string(), 0, 0}, "", "cannot be read, or is empty");
  History history;
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) history.columns.push_back(cell);
  history.values.resize(history.columns.size());
  while (std::getline(stream, line)) {
    if (stream.eof()) break;  // a line without its end is still being written
    std::istringstream cells(line);
    for (std::vector<double>& column : history.values) {
      std::getline(cells, cell, ',');
      column.push_back(std::strtod(cell.c_str(), nullptr));
    }
  }
  return history;
}

}  // namespace perikit
