#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <iterator>

#include "files/atomic_file.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

std::string header_line(const std::vector<std::string>& columns) {
  return fmt::format("{}\n", fmt::join(columns, ","));
}

void check_columns(const std::filesystem::path& file, const std::vector<std::string>& columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool repeated = std::find(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(i), columns[i]) !=
                          columns.begin() + static_cast<std::ptrdiff_t>(i);
    if (repeated)
      throw InputError({file.string(), 0, 0}, columns[i], "this column appears twice; every column needs its own name");
    if (columns[i].empty() || columns[i].find_first_of(",\"#\r\n") != std::string::npos) {
      throw InputError({file.string(), 0, 0}, columns[i],
                       "a column's name must hold a text without comma, quote, # and line break");
    }
  }
}

/// Header and the first `rows` rows of an earlier run's file; a last line without its end was torn and does not count.
std::string kept_text(const std::filesystem::path& file, const std::string& header, std::int64_t rows) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw_system_error(file, "cannot read", errno);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!text.starts_with(header)) {
    throw InputError({file.string(), 1, 1}, "",
                     fmt::format("cannot be continued: found the columns {}; must be {}", text.substr(0, text.find('\n')),
                                 header.substr(0, header.size() - 1)));
  }
  std::size_t end = header.size();
  for (std::int64_t row = 0; row < rows; ++row) {
    const std::size_t line_end = text.find('\n', end);
    if (line_end == std::string::npos) {
      throw InputError({file.string(), 0, 0}, "",
                       fmt::format("cannot be continued: found {} rows; must be at least {}", row, rows));
    }
    end = line_end + 1;
  }
  text.resize(end);
  return text;
}

}  // namespace

struct HistoryWriter::Implementation {
  std::filesystem::path file;
  std::vector<std::string> columns;
  std::vector<bool> may_be_missing;
  Descriptor descriptor;
  off_t size = 0;
  std::int64_t rows = 0;
};

HistoryWriter::HistoryWriter(const std::filesystem::path& file, std::vector<std::string> columns, std::int64_t keep_rows,
                             const std::vector<std::string>& missing)
    : implementation_(std::make_unique<Implementation>()) {
  check_columns(file, columns);
  const std::string header = header_line(columns);
  const std::string text = keep_rows >= 0 ? kept_text(file, header, keep_rows) : header;
  write_file_atomically(file, text);
  Descriptor descriptor(::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  if (!descriptor) throw_system_error(file, "cannot write", errno);
  std::vector<bool> may_be_missing;
  for (const std::string& column : columns) may_be_missing.push_back(std::ranges::find(missing, column) != missing.end());
  *implementation_ = {file, std::move(columns), std::move(may_be_missing), std::move(descriptor), static_cast<off_t>(text.size()), std::max<std::int64_t>(keep_rows, 0)};
}

HistoryWriter::~HistoryWriter() {
  if (implementation_->descriptor) ::fsync(implementation_->descriptor.get());
}

void HistoryWriter::row(std::span<const double> values) {
  Implementation& self = *implementation_;
  if (values.size() != self.columns.size()) {
    throw RunError(
        fmt::format("{}: found {} values; there are {} columns", self.file.string(), values.size(), self.columns.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i]) || self.may_be_missing[i]) continue;
    throw RunError(fmt::format("{}: column '{}' is {} where {} = {}", self.file.string(), self.columns[i], values[i],
                               self.columns[0], values[0]));
  }
  const std::string line = fmt::format("{}\n", fmt::join(values, ","));
  if (const int code = write_all(self.descriptor.get(), std::as_bytes(std::span(line)))) {
    // A row that did not fit leaves no torn line.
    [[maybe_unused]] const int ignored = ::ftruncate(self.descriptor.get(), self.size);
    throw_system_error(self.file, "cannot write", code);
  }
  self.size += static_cast<off_t>(line.size());
  ++self.rows;
}

void HistoryWriter::sync() {
  if (::fsync(implementation_->descriptor.get()) != 0) throw_system_error(implementation_->file, "cannot write", errno);
}

std::int64_t HistoryWriter::rows() const noexcept {
  return implementation_->rows;
}

}  // namespace perikit
