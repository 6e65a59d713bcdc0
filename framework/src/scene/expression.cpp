#include "perikit/scene/expression.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "scene/expression_names.hpp"
#include "scene/toml_text.hpp"

namespace perikit {

struct Expression::Parser {
  mu::Parser parser;
  std::array<double, 4> variables{};  // x, y, z, t
  SourcePosition position;
  std::string key;
};

namespace {

constexpr std::array<const char*, 4> variable_names{"x", "y", "z", "t"};

/// muParser with our additions: pi, and rounding and power functions that it lacks.
mu::Parser make_parser() {
  mu::Parser parser;
  parser.ClearConst();  // _pi and _e: scenes have pi and exp
  parser.DefineConst("pi", std::numbers::pi);
  parser.DefineFun(
      "floor", +[](double v) { return std::floor(v); });
  parser.DefineFun(
      "ceil", +[](double v) { return std::ceil(v); });
  parser.DefineFun(
      "pow", +[](double a, double b) { return std::pow(a, b); });
  return parser;
}

bool letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) || c == '_';
}
bool digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c));
}

struct Name {
  std::string text;
  std::size_t at = 0;
};

/// Names in the text, numbers such as 1e5 skipped.
std::vector<Name> names_in(const std::string& text) {
  std::vector<Name> names;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t begin = i;
    if (letter(text[i])) {
      while (i < text.size() && (letter(text[i]) || digit(text[i]))) ++i;
      names.push_back({text.substr(begin, i - begin), begin});
    } else if (digit(text[i]) || text[i] == '.') {
      while (i < text.size() && (digit(text[i]) || text[i] == '.')) ++i;
      const std::size_t sign = i + 1 < text.size() && (text[i + 1] == '+' || text[i + 1] == '-') ? 2 : 1;
      if (i + sign < text.size() && (text[i] == 'e' || text[i] == 'E') && digit(text[i + sign])) i += sign;
    } else {
      ++i;
    }
  }
  return names;
}

/// Position of a lone '=', which muParser would take as an assignment to x.
std::size_t assignment_in(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    if (i + 1 < text.size() && text[i + 1] == '=')
      ++i;
    else if (i == 0 || std::string_view("<>!").find(text[i - 1]) == std::string_view::npos)
      return i;
  }
  return std::string::npos;
}

/// As written; muParser adds a blank.
std::string text_of(const mu::Parser& parser) {
  std::string text = parser.GetExpr();
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

std::string reason(const mu::ParserError& error) {
  const std::string where = error.GetPos() >= 0 ? fmt::format(" at character {}", error.GetPos() + 1) : "";
  switch (error.GetCode()) {
    case mu::ecUNEXPECTED_EOF:
      return "it ends too early";
    case mu::ecEMPTY_EXPRESSION:
      return "it is empty";
    case mu::ecMISSING_PARENS:
      return "a closing parenthesis is missing";
    case mu::ecUNEXPECTED_PARENS:
      return fmt::format("unexpected '{}'{}", error.GetToken(), where);
    case mu::ecTOO_MANY_PARAMS:
      return fmt::format("too many arguments for '{}'{}", error.GetToken(), where);
    case mu::ecTOO_FEW_PARAMS:
      return fmt::format("too few arguments for '{}'{}", error.GetToken(), where);
    case mu::ecMISSING_ELSE_CLAUSE:
      return "'?' without ':'";
    case mu::ecMISPLACED_COLON:
      return "':' without '?'";
    case mu::ecEXPRESSION_TOO_LONG:
      return "it is too long";
    default:
      return error.GetToken().empty() ? "it cannot be read" + where : fmt::format("unexpected '{}'{}", error.GetToken(), where);
  }
}

}  // namespace

std::vector<std::string> expression_words() {
  std::vector<std::string> words{"x", "y", "z", "t", "pi"};
  const mu::Parser parser = make_parser();
  for (const auto& [name, function] : parser.GetFunDef()) words.push_back(name);
  return words;
}

std::vector<std::string> names_of_expression(const std::string& text) {
  std::vector<std::string> names;
  for (Name& name : names_in(text)) names.push_back(std::move(name.text));
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

  for (const Name& name : names_in(text)) {
    if (name.text == "t" && !with_time) throw refuse(fmt::format("t is not allowed here; allowed: {}", allowed_names));
    if (std::find(known.begin(), known.end(), name.text) == known.end()) {
      throw refuse(fmt::format("unknown name '{}' at character {}; allowed: {} and the usual functions{}", name.text, name.at + 1,
                               allowed_names, did_you_mean(name.text, known)));
    }
    uses_t_ |= name.text == "t";
    uses_position_ |= name.text == "x" || name.text == "y" || name.text == "z";
  }
  if (const std::size_t at = assignment_in(text); at != std::string::npos) {
    throw refuse(fmt::format("'=' at character {}; allowed: comparisons, which are written ==, <=, >= or !=", at + 1));
  }
  try {
    parser.SetExpr(text);
    parser.Eval();
  } catch (const mu::ParserError& error) {
    throw refuse(reason(error) + "; allowed: + - * / ^, comparisons, && ||, ?:, functions, numbers and " + allowed_names);
  }
  if (parser.GetNumResults() != 1) throw refuse("it has several values; allowed: one");
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
                                 reason(error)));
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
