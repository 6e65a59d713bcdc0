// The table of a study as CSV and Markdown.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "study/series.hpp"
#include "study/study.hpp"

namespace perikit {

namespace {

std::vector<std::string> header(const Study& study) {
  std::vector<std::string> columns{"run"};
  for (const StudyKey& key : study.keys) columns.push_back(key.key);
  for (const StudyQuantity& quantity : study.quantities) {
    columns.push_back(quantity.name);
    if (quantity.reference) columns.push_back(quantity.error_column());
  }
  columns.insert(columns.end(), {"status", "reason"});
  return columns;
}

std::vector<std::string> cells(const StudyTable& table, const StudyRow& row, int digits) {
  const auto number = [&](const std::optional<double>& value) { return value ? fmt::format("{:.{}g}", *value, digits) : ""; };
  std::vector<std::string> texts{fmt::format("{}", row.run)};
  for (const StudyValue& value : row.values) texts.push_back(value.shown);
  for (std::size_t q = 0; q < row.quantities.size(); ++q) {
    texts.push_back(number(row.quantities[q]));
    if (table.study.quantities[q].reference) texts.push_back(number(row.errors[q]));
  }
  texts.insert(texts.end(), {row.status, row.reason});
  return texts;
}

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
  std::string text = "\"";
  for (const char c : cell) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

std::string escaped(const std::string& cell) {
  std::string text;
  for (const char c : cell) text += c == '|' ? std::string("\\|") : c == '\n' ? std::string("<br>") : std::string(1, c);
  return text;
}

}  // namespace

std::optional<double> StudyTable::number(const StudyRow& row, const std::string& column) const {
  for (std::size_t k = 0; k < study.keys.size(); ++k) {
    if (study.keys[k].key == column) return row.values[k].number;
  }
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    if (study.quantities[q].name == column) return row.quantities[q];
    if (study.quantities[q].error_column() == column) return row.errors[q];
  }
  return std::nullopt;
}

std::string StudyTable::csv() const {
  std::string text;
  const auto line = [&](std::vector<std::string> texts) {
    std::ranges::transform(texts, texts.begin(), quoted);
    text += fmt::format("{}\n", fmt::join(texts, ","));
  };
  line(header(study));
  for (const StudyRow& row : rows) line(cells(*this, row, 17));
  return text;
}

std::string StudyTable::markdown() const {
  std::string text = study.title.empty() ? "" : fmt::format("# {}\n\n", study.title);
  const auto line = [&](std::vector<std::string> texts) {
    std::ranges::transform(texts, texts.begin(), escaped);
    text += fmt::format("| {} |\n", fmt::join(texts, " | "));
  };
  line(header(study));
  line(std::vector<std::string>(header(study).size(), "---"));
  for (const StudyRow& row : rows) line(cells(*this, row, 6));
  if (study.plot && study.plot->level) (text += '\n') += level_table(*this);
  if (const std::string orders = order_table(*this); !orders.empty()) (text += '\n') += orders;
  return text;
}

}  // namespace perikit
