#include "perikit/body/point_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "body/positions_file.hpp"
#include "files/hdf5_file.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

/// x, y, z, volume: the order in which a row of values is kept.
const std::vector<std::string> column_names{"x", "y", "z", "volume"};
constexpr int volume_column = 3;
using Row = std::array<double, 4>;

/// Empty where the row is a valid point; else the first wrong column and what is wrong with it.
struct Fault {
  int column = 0;
  std::string message;
};
std::optional<Fault> fault_of(const Row& row, int dimension) {
  for (int c = 0; c < 4; ++c) {
    const double value = row[static_cast<std::size_t>(c)];
    if (!std::isfinite(value)) return Fault{c, fmt::format("found {}; allowed: a finite number", value)};
    if (c == volume_column && value <= 0) return Fault{c, fmt::format("found {}; allowed: a number > 0", value)};
    if (c < volume_column && c >= dimension && value != 0) {
      return Fault{c, fmt::format("found {}; allowed: 0 (or no column at all) in a body of dimension {}", value, dimension)};
    }
  }
  return {};
}

void add(PointCloud& cloud, const Row& row) {
  cloud.position.push_back({row[0], row[1], row[2]});
  cloud.volume.push_back(row[volume_column]);
}

/// Which columns a file must have.
struct Wanted {
  int dimension;
  bool volumes;
  bool required(int column) const { return column == volume_column ? volumes : column < dimension; }
};

std::string wanted_columns(const Wanted& wanted) {
  std::vector<std::string> names;
  for (int c = 0; c < 4; ++c) {
    if (wanted.required(c)) names.push_back(column_names[static_cast<std::size_t>(c)]);
  }
  return fmt::format("{}", fmt::join(names, ","));
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return text.substr(0, 0);
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

class CsvReader {
 public:
  CsvReader(const std::filesystem::path& file, const Wanted& wanted) : file_(file), wanted_(wanted) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file)) {
      const int code = stream ? EISDIR : errno;
      throw InputError({file.string(), 0, 0}, "", "cannot be read: " + std::generic_category().message(code));
    }
    text_.resize(std::filesystem::file_size(file));
    stream.read(text_.data(), static_cast<std::streamsize>(text_.size()));
    if (text_.starts_with("\xEF\xBB\xBF")) text_.erase(0, 3);
  }

  PointCloud read() {
    if (!next_line()) refuse(line_start(), "", fmt::format("found no header line; allowed: {}", wanted_columns(wanted_)), 0);
    read_header();
    PointCloud cloud;
    while (next_line()) add(cloud, read_row());
    if (cloud.volume.empty()) refuse(line_start(), "", "found no points behind the header line; allowed: one or more", 0);
    return cloud;
  }

 private:
  [[noreturn]] void refuse(const char* where, std::string_view key, const std::string& message, int line) const {
    throw InputError({file_.string(), line, static_cast<int>(where - line_start()) + 1}, key, message);
  }
  const char* line_start() const { return text_.data() + start_; }

  /// Goes to the next line that holds more than blanks and comments; false at the end of the file.
  bool next_line() {
    while (next_ < text_.size()) {
      start_ = next_;
      const std::size_t end = std::min(text_.find('\n', start_), text_.size());
      next_ = end + 1;
      ++line_;
      content_ = std::string_view(text_).substr(start_, end - start_);
      content_ = content_.substr(0, content_.find('#'));
      if (content_.ends_with('\r')) content_.remove_suffix(1);
      if (!trimmed(content_).empty()) return true;
    }
    return false;
  }

  /// Cuts the next cell off `rest`; `more` tells whether another one follows.
  static std::string_view next_cell(std::string_view& rest, bool& more) {
    const std::size_t comma = rest.find(',');
    const std::string_view cell = rest.substr(0, comma);
    more = comma != std::string_view::npos;
    rest.remove_prefix(more ? comma + 1 : rest.size());
    return trimmed(cell);
  }

  void read_header() {
    std::string_view rest = content_;
    for (bool more = true; more;) {
      std::string_view cell = next_cell(rest, more);
      const char* where = cell.data();
      if (cell.size() > 1 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
      const auto known = std::find(column_names.begin(), column_names.end(), cell);
      if (known == column_names.end()) {
        refuse(where, "", fmt::format("found column '{}'; allowed: x,y,z,volume{}", cell, did_you_mean(cell, column_names)),
               line_);
      }
      const int column = static_cast<int>(known - column_names.begin());
      if (std::find(order_.begin(), order_.end(), column) != order_.end()) {
        refuse(where, "", fmt::format("found column '{}' twice; allowed: each once", cell), line_);
      }
      order_.push_back(column);
    }
    for (int c = 0; c < 4; ++c) {
      if (wanted_.required(c) && std::find(order_.begin(), order_.end(), c) == order_.end()) {
        refuse(line_start(), "",
               fmt::format("found no column '{}' in '{}'; allowed: {}", column_names[static_cast<std::size_t>(c)],
                           trimmed(content_), wanted_columns(wanted_)),
               line_);
      }
    }
  }

  Row read_row() const {
    Row row{0, 0, 0, 1};
    std::array<const char*, 4> where{};
    std::string_view rest = content_;
    std::size_t cells = 0;
    for (bool more = true; more; ++cells) {
      const std::string_view cell = next_cell(rest, more);
      if (cells >= order_.size()) continue;
      const auto column = static_cast<std::size_t>(order_[cells]);
      where[column] = cell.data();
      if (column != volume_column || wanted_.volumes) row[column] = number(cell, column_names[column]);
    }
    if (cells != order_.size()) {
      refuse(line_start(), "",
             fmt::format("found {} cells; allowed: {}, as many as the header has columns", cells, order_.size()), line_);
    }
    if (const std::optional<Fault> fault = fault_of(row, wanted_.dimension)) {
      const auto column = static_cast<std::size_t>(fault->column);
      refuse(where[column], column_names[column], fault->message, line_);
    }
    return row;
  }

  double number(std::string_view cell, const std::string& column) const {
    std::string_view digits = cell;
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range)
      refuse(cell.data(), column, fmt::format("found {}; allowed: numbers in double precision", cell), line_);
    if (error != std::errc() || end != digits.data() + digits.size()) {
      refuse(cell.data(), column, fmt::format("found '{}'; allowed: a number", cell), line_);
    }
    return value;
  }

  std::filesystem::path file_;
  Wanted wanted_;
  std::string text_;
  std::size_t start_ = 0, next_ = 0;
  int line_ = 0;
  std::string_view content_;
  std::vector<int> order_;  ///< column of each cell
};

PointCloud read_hdf5(const std::filesystem::path& file, const Wanted& wanted) {
  const hdf5::Source source(file);
  const auto refuse = [&](int column, const std::string& message) {
    throw InputError({file.string(), 0, 0}, column_names[static_cast<std::size_t>(column)], message);
  };
  std::array<std::vector<double>, 4> columns;
  const int counted = wanted.volumes ? volume_column : 0;  // of whose numbers all columns must have as many
  const std::vector<double>& first = columns[static_cast<std::size_t>(counted)];
  for (const int c : {counted, 0, 1, 2, volume_column}) {
    const std::string& name = column_names[static_cast<std::size_t>(c)];
    std::vector<double>& column = columns[static_cast<std::size_t>(c)];
    if (c == volume_column && !wanted.volumes) {
      column.assign(first.size(), 1.0);
    } else if (source.contains(name)) {
      column = source.read(name).data;
    } else if (wanted.required(c)) {
      refuse(c, fmt::format("found no such dataset; allowed: {}", wanted_columns(wanted)));
    } else {
      column.assign(first.size(), 0.0);
    }
    if (column.size() != first.size())
      refuse(c, fmt::format("found {} values; allowed: {}, as many as {} has", column.size(), first.size(),
                            column_names[static_cast<std::size_t>(counted)]));
  }
  const std::vector<double>& volume = columns[volume_column];
  if (volume.empty()) refuse(counted, "found no points; allowed: one or more");
  PointCloud cloud;
  for (std::size_t i = 0; i < volume.size(); ++i) {
    const Row row{columns[0][i], columns[1][i], columns[2][i], volume[i]};
    if (const std::optional<Fault> fault = fault_of(row, wanted.dimension))
      refuse(fault->column, fmt::format("point {}: {}", i, fault->message));
    add(cloud, row);
  }
  return cloud;
}

PointCloud read(const std::filesystem::path& file, const Wanted& wanted) {
  const std::filesystem::path extension = file.extension();
  if (extension == ".h5" || extension == ".hdf5") return read_hdf5(file, wanted);
  return CsvReader(file, wanted).read();
}

}  // namespace

PointCloud read_points(const std::filesystem::path& file, int dimension) {
  return read(file, {dimension, true});
}

PointCloud read_positions(const std::filesystem::path& file, int dimension) {
  return read(file, {dimension, false});
}

}  // namespace perikit
