#include "scene/expressions/expression_parser.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <numbers>

namespace perikit {

namespace {

bool letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) || c == '_';
}
bool digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c));
}

/// Position of a lone '=', which muParser would take as an assignment; npos where there is none.
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

}  // namespace

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

std::vector<Word> words_in(const std::string& text) {
  std::vector<Word> names;
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

std::string text_of(const mu::Parser& parser) {
  std::string text = parser.GetExpr();
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

std::string fault_of(const mu::ParserError& error) {
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

std::string parse(mu::Parser& parser, const std::string& text, const std::string& allowed_names) {
  if (const std::size_t at = assignment_in(text); at != std::string::npos)
    return fmt::format("'=' at character {}; allowed: comparisons, which are written ==, <=, >= or !=", at + 1);
  try {
    parser.SetExpr(text);
    parser.Eval();
  } catch (const mu::ParserError& error) {
    return fault_of(error) + "; allowed: + - * / ^, comparisons, && ||, ?:, functions, numbers and " + allowed_names;
  }
  return parser.GetNumResults() == 1 ? "" : "it has several values; allowed: one";
}

}  // namespace perikit
