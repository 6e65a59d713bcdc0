#include "scene/expressions/column_expression.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/expressions/expression_names.hpp"
#include "scene/expressions/expression_parser.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

struct ColumnExpression::Parser {
  mu::Parser parser;
  std::vector<double> columns;
  double t = 0;
};

namespace {

/// Whether an expression can use it: letters, digits and underscores.
bool is_word(const std::string& name) {
  const std::vector<Word> words = words_in(name);
  return words.size() == 1 && words.front().text == name;
}

}  // namespace

ColumnExpression::ColumnExpression(const std::string& text, const std::vector<std::string>& columns, const Constants& constants, SourcePosition position,
                                   std::string key)
    : text_(text), position_(std::move(position)), parser_(std::make_shared<Parser>()) {
  const auto refuse = [&](const std::string& why) { return InputError(position_, key, fmt::format("found the expression {}: {}", toml_string(excerpt(text)), why)); };
  const auto has = [](const std::vector<std::string>& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); };
  mu::Parser& parser = parser_->parser;
  parser = make_parser();
  std::vector<std::string> functions, known;
  for (const auto& [name, function] : parser.GetFunDef()) functions.push_back(name);
  std::ranges::copy_if(columns, std::back_inserter(known), is_word);
  known.insert(known.end(), {"t", "pi"});
  for (const auto& [name, value] : constants) known.push_back(name);
  const std::string allowed_names = fmt::format("{}", fmt::join(known, ", "));
  for (const Word& word : words_in(text)) {
    const bool column = has(columns, word.text), other = word.text == "t" || word.text == "pi" || constants.contains(word.text) || has(functions, word.text);
    if (column && other)
      throw refuse(fmt::format("'{}' at character {} is a column and {}; allowed: another name of the column", word.text, word.at + 1,
                               word.text == "t" ? "the time" : constants.contains(word.text) ? "a constant" : "a word of expressions"));
    if (column && !has(columns_, word.text)) columns_.push_back(word.text);
    if (column || other) continue;
    std::vector<std::string> all = known;
    all.insert(all.end(), functions.begin(), functions.end());
    throw refuse(fmt::format("unknown name '{}' at character {}; allowed: {} and the usual functions{}", word.text, word.at + 1, allowed_names,
                             did_you_mean(word.text, all)));
  }
  parser_->columns.assign(columns_.size(), 1.0);
  for (std::size_t k = 0; k < columns_.size(); ++k) parser.DefineVar(columns_[k], &parser_->columns[k]);
  parser.DefineVar("t", &parser_->t);
  for (const auto& [name, value] : constants)
    if (!has(columns_, name)) parser.DefineConst(name, value);
  if (const std::string fault = parse(parser, text, allowed_names); !fault.empty()) throw refuse(fault);
}

double ColumnExpression::operator()(std::span<const double> values, double t) const {
  std::ranges::copy(values, parser_->columns.begin());
  parser_->t = t;
  const double value = parser_->parser.Eval();
  return std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace perikit
