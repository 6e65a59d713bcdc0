#include "body/points/point_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "body/partition/point_share.hpp"
#include "body/points/positions_file.hpp"
#include "files/hdf5_file.hpp"
#include "perikit/core/rank_values.hpp"

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

/// Which of so many things that follow each other are wanted: own_run or all of them.
using WantedRun = std::function<Run(std::int64_t count)>;
Run all_of(std::int64_t count) {
  return {0, count};
}

class CsvReader {
 public:
  CsvReader(const std::filesystem::path& file, const Wanted& wanted)
      : file_(file), wanted_(wanted), stream_(file, std::ios::binary) {
    if (!stream_ || std::filesystem::is_directory(file)) {
      const int code = stream_ ? EISDIR : errno;
      throw InputError({file.string(), 0, 0}, "", "cannot be read: " + std::generic_category().message(code));
    }
    size_ = static_cast<std::int64_t>(std::filesystem::file_size(file));
    read_header();
  }

  /// The points of the lines that begin in a run of what follows the header line.
  PointCloud read(const WantedRun& wanted_run) {
    const Run run = wanted_run(size_ - data_);
    read_lines(data_ + run.first, data_ + run.last);
    PointCloud cloud;
    while (next_line()) add(cloud, read_row());
    return cloud;
  }

 private:
  [[noreturn]] void refuse(const char* where, std::string_view key, const std::string& message) {
    throw InputError({file_.string(), static_cast<int>(lines_before() + line_), static_cast<int>(where - line_start()) + 1}, key,
                     message);
  }
  const char* line_start() const { return text_.data() + start_; }

  /// Lines of the file before the text: counted where one has to be named.
  std::int64_t lines_before() {
    stream_.clear();
    stream_.seekg(0);
    std::int64_t lines = 0;
    std::string piece;
    for (std::int64_t left = text_begin_; left > 0; left -= std::ssize(piece)) {
      piece.resize(static_cast<std::size_t>(std::min<std::int64_t>(left, 1 << 20)));
      stream_.read(piece.data(), std::ssize(piece));
      lines += std::count(piece.begin(), piece.end(), '\n');
    }
    return lines;
  }

  /// The text from here on, with the rest of the line that is not yet at its end.
  void read_text(std::int64_t first, std::int64_t last) {
    text_begin_ = first;
    start_ = next_ = 0;
    line_ = 0;
    text_.resize(static_cast<std::size_t>(last - first));
    stream_.clear();
    stream_.seekg(first);
    stream_.read(text_.data(), std::ssize(text_));
    std::string rest;
    if (!text_.ends_with('\n') && std::getline(stream_, rest)) text_ += rest;
  }

  /// The lines that begin in first ... last - 1.
  void read_lines(std::int64_t first, std::int64_t last) {
    const bool inside = first > data_ && first < last;  // whether a line may have begun before
    read_text(inside ? first - 1 : first, first < last ? last : first);
    if (first >= last) text_.clear();
    if (!inside) return;
    // Where no line ends before `last`, none begins.
    next_ = std::min(text_.find('\n'), text_.size()) + 1;
    line_ = 1;
    if (text_begin_ + static_cast<std::int64_t>(next_) >= last) text_.clear();
  }

  /// Goes to the next line that holds more than blanks and comments; false at the end of the text.
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

  /// Finds the header line, and where the lines after it begin.
  void read_header() {
    constexpr std::string_view mark = "\xEF\xBB\xBF";
    read_text(0, std::min<std::int64_t>(size_, std::ssize(mark)));
    data_ = text_.starts_with(mark) ? std::ssize(mark) : 0;
    for (bool found = false; !found; data_ = text_begin_ + std::ssize(text_) + 1) {
      if (data_ >= size_)
        throw InputError({file_.string(), 0, 1}, "", fmt::format("found no header line; allowed: {}", wanted_columns(wanted_)));
      read_text(data_, data_);
      found = next_line();
    }
    data_ = std::min(data_, size_);
    read_columns();
  }

  /// Cuts the next cell off `rest`; `more` tells whether another one follows.
  static std::string_view next_cell(std::string_view& rest, bool& more) {
    const std::size_t comma = rest.find(',');
    const std::string_view cell = rest.substr(0, comma);
    more = comma != std::string_view::npos;
    rest.remove_prefix(more ? comma + 1 : rest.size());
    return trimmed(cell);
  }

  void read_columns() {
    std::string_view rest = content_;
    for (bool more = true; more;) {
      std::string_view cell = next_cell(rest, more);
      const char* where = cell.data();
      if (cell.size() > 1 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
      const auto known = std::find(column_names.begin(), column_names.end(), cell);
      if (known == column_names.end()) {
        refuse(where, "", fmt::format("found column '{}'; allowed: x,y,z,volume{}", cell, did_you_mean(cell, column_names)));
      }
      const int column = static_cast<int>(known - column_names.begin());
      if (std::find(order_.begin(), order_.end(), column) != order_.end()) {
        refuse(where, "", fmt::format("found column '{}' twice; allowed: each once", cell));
      }
      order_.push_back(column);
    }
    for (int c = 0; c < 4; ++c) {
      if (wanted_.required(c) && std::find(order_.begin(), order_.end(), c) == order_.end()) {
        refuse(line_start(), "",
               fmt::format("found no column '{}' in '{}'; allowed: {}", column_names[static_cast<std::size_t>(c)],
                           trimmed(content_), wanted_columns(wanted_)));
      }
    }
  }

  Row read_row() {
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
             fmt::format("found {} cells; allowed: {}, as many as the header has columns", cells, order_.size()));
    }
    if (const std::optional<Fault> fault = fault_of(row, wanted_.dimension)) {
      const auto column = static_cast<std::size_t>(fault->column);
      refuse(where[column], column_names[column], fault->message);
    }
    return row;
  }

  double number(std::string_view cell, const std::string& column) {
    std::string_view digits = cell;
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range)
      refuse(cell.data(), column, fmt::format("found {}; allowed: numbers in double precision", cell));
    if (error != std::errc() || end != digits.data() + digits.size()) {
      refuse(cell.data(), column, fmt::format("found '{}'; allowed: a number", cell));
    }
    return value;
  }

  std::filesystem::path file_;
  Wanted wanted_;
  std::ifstream stream_;
  std::int64_t size_ = 0, data_ = 0;  ///< bytes of the file, and before the lines of points
  std::string text_;
  std::int64_t text_begin_ = 0;  ///< in the file
  std::size_t start_ = 0, next_ = 0;
  std::int64_t line_ = 0;  ///< of the text, from 1 on
  std::string_view content_;
  std::vector<int> order_;  ///< column of each cell
};

PointCloud read_hdf5(const std::filesystem::path& file, const Wanted& wanted, const WantedRun& wanted_run) {
  const hdf5::Source source(file);
  const auto refuse = [&](int column, const std::string& message) {
    throw InputError({file.string(), 0, 0}, column_names[static_cast<std::size_t>(column)], message);
  };
  std::array<std::vector<double>, 4> columns;
  const int counted = wanted.volumes ? volume_column : 0;  // of whose numbers all columns must have as many
  std::int64_t points = -1;
  Run run;
  for (const int c : {counted, 0, 1, 2, volume_column}) {
    const std::string& name = column_names[static_cast<std::size_t>(c)];
    std::vector<double>& column = columns[static_cast<std::size_t>(c)];
    if (c == volume_column && !wanted.volumes) {
      column.assign(static_cast<std::size_t>(run.last - run.first), 1.0);
    } else if (source.contains(name)) {
      const auto values = static_cast<std::int64_t>(source.values(name));
      if (points < 0) {
        points = values;
        run = wanted_run(points);
      }
      if (values != points)
        refuse(c, fmt::format("found {} values; allowed: {}, as many as {} has", values, points,
                              column_names[static_cast<std::size_t>(counted)]));
      column = source.read(name, static_cast<std::size_t>(run.first), static_cast<std::size_t>(run.last));
    } else if (wanted.required(c)) {
      refuse(c, fmt::format("found no such dataset; allowed: {}", wanted_columns(wanted)));
    } else {
      column.assign(static_cast<std::size_t>(run.last - run.first), 0.0);
    }
  }
  if (points == 0) refuse(counted, "found no points; allowed: one or more");
  PointCloud cloud;
  for (std::int64_t n = run.first; n < run.last; ++n) {
    const auto i = static_cast<std::size_t>(n - run.first);
    const Row row{columns[0][i], columns[1][i], columns[2][i], columns[volume_column][i]};
    if (const std::optional<Fault> fault = fault_of(row, wanted.dimension))
      refuse(fault->column, fmt::format("point {}: {}", n, fault->message));
    add(cloud, row);
  }
  return cloud;
}

PointCloud read(const std::filesystem::path& file, const Wanted& wanted, const WantedRun& wanted_run) {
  const std::filesystem::path extension = file.extension();
  if (extension == ".h5" || extension == ".hdf5") return read_hdf5(file, wanted, wanted_run);
  return CsvReader(file, wanted).read(wanted_run);
}

/// points: of all runs.
void refuse_empty(const std::filesystem::path& file, std::int64_t points) {
  if (points == 0) throw InputError({file.string(), 0, 1}, "", "found no points behind the header line; allowed: one or more");
}

PointCloud read_all(const std::filesystem::path& file, const Wanted& wanted) {
  PointCloud cloud = read(file, wanted, all_of);
  refuse_empty(file, std::ssize(cloud.volume));
  return cloud;
}

PointCloud read_run(const std::filesystem::path& file, const Wanted& wanted) {
  PointCloud cloud = agreed([&] { return read(file, wanted, own_run); });
  refuse_empty(file, counted(std::ssize(cloud.volume)).all);
  return cloud;
}

}  // namespace

PointCloud read_points(const std::filesystem::path& file, int dimension) {
  return read_all(file, {dimension, true});
}

PointCloud read_positions(const std::filesystem::path& file, int dimension) {
  return read_all(file, {dimension, false});
}

PointCloud read_run_of_points(const std::filesystem::path& file, int dimension) {
  return read_run(file, {dimension, true});
}

PointCloud read_run_of_positions(const std::filesystem::path& file, int dimension) {
  return read_run(file, {dimension, false});
}

void over_points_of_file(const std::filesystem::path& file, int dimension, const std::function<void(const PointCloud&)>& use) {
  constexpr std::int64_t piece = 1 << 22;  // bytes of lines, or points
  std::int64_t all = 1, points = 0;
  for (std::int64_t first = 0; first < all; first += piece) {
    const PointCloud cloud = read(file, {dimension, true}, [&](std::int64_t count) {
      all = count;
      return Run{first, std::min(count, first + piece)};
    });
    points += std::ssize(cloud.volume);
    use(cloud);
  }
  refuse_empty(file, points);
}

}  // namespace perikit
