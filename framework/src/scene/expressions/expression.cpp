#include "scene/expressions/expression.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "scene/expressions/expression_names.hpp"
#include "scene/expressions/expression_parser.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

struct Expression::Parser {
  mu::Parser parser;
  std::array<double, 4> variables{};  // x, y, z, t
  SourcePosition position;
  std::string key;
};

namespace {

constexpr std::array<const char*, 4> variable_names{"x", "y", "z", "t"};

}  // namespace

std::vector<std::string> expression_words() {
  std::vector<std::string> words{"x", "y", "z", "t", "pi"};
  const mu::Parser parser = make_parser();
  for (const auto& [name, function] : parser.GetFunDef()) words.push_back(name);
  return words;
}

std::vector<std::string> names_of_expression(const std::string& text) {
  std::vector<std::string> names;
  for (Word& name : words_in(text)) names.push_back(std::move(name.text));
  return names;
}

Expression::Expression(double number) : number_(number) {}

Expression::Expression(const std::variant<double, std::string>& value, const Constants& constants, bool with_time,
                       SourcePosition position, std::string key) {
  if (const double* number = std::get_if<double>(&value)) {
    number_ = *number;
  } else {
    *this = Expression(std::get<std::string>(value), constants, with_time, std::move(position), std::move(key));
  }
}

Expression::Expression(const std::string& text, const Constants& constants, bool with_time, SourcePosition position,
                       std::string key)
    : parser_(std::make_shared<Parser>()) {
  parser_->position = std::move(position);
  parser_->key = std::move(key);
  const auto refuse = [&](const std::string& why) {
    return InputError(parser_->position, parser_->key,
                      fmt::format("found the expression {}: {}", toml_string(excerpt(text)), why));
  };

  mu::Parser& parser = parser_->parser;
  parser = make_parser();
  std::vector<std::string> known{"x", "y", "z"};
  if (with_time) known.push_back("t");
  for (std::size_t i = 0; i < known.size(); ++i) parser.DefineVar(variable_names[i], &parser_->variables[i]);
  known.push_back("pi");
  for (const auto& [name, value] : constants) {
    known.push_back(name);
    parser.DefineConst(name, value);
  }
  const std::string allowed_names = fmt::format("{}", fmt::join(known, ", "));
  for (const auto& [name, function] : parser.GetFunDef()) known.push_back(name);

  for (const Word& name : words_in(text)) {
    if (name.text == "t" && !with_time) throw refuse(fmt::format("t is not allowed here; allowed: {}", allowed_names));
    if (std::find(known.begin(), known.end(), name.text) == known.end()) {
      throw refuse(fmt::format("unknown name '{}' at character {}; allowed: {} and the usual functions{}", name.text, name.at + 1,
                               allowed_names, did_you_mean(name.text, known)));
    }
    uses_t_ |= name.text == "t";
    uses_position_ |= name.text == "x" || name.text == "y" || name.text == "z";
  }
  if (const std::string fault = parse(parser, text, allowed_names); !fault.empty()) throw refuse(fault);
}

double Expression::operator()(const std::array<double, 3>& x, double t) const {
  if (!parser_) return number_;
  parser_->variables = {x[0], x[1], x[2], t};
  double value = 0.0;
  try {
    value = parser_->parser.Eval();
  } catch (const mu::ParserError& error) {
    throw InputError(parser_->position, parser_->key,
                     fmt::format("found the expression \"{}\", which fails: {}; allowed: finite values", text_of(parser_->parser),
                                 fault_of(error)));
  }
  if (!std::isfinite(value)) {
    if (std::isnan(value)) value = std::abs(value);   // its sign is the processor's choice
    throw InputError(parser_->position, parser_->key,
                     fmt::format("found the expression \"{}\", which is {} at x = ({}, {}, {}), t = {}; allowed: finite values",
                                 text_of(parser_->parser), value, x[0], x[1], x[2], t));
  }
  return value;
}

}  // namespace perikit
