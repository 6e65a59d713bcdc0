#pragma once
/// What all expressions of scenes share: muParser as it is set up here, and the checks that it lacks.

#include <muParser.h>

#include <string>
#include <vector>

namespace perikit {

/// muParser with our additions: pi, and rounding and power functions that it lacks.
mu::Parser make_parser();

struct Word {
  std::string text;
  std::size_t at = 0;
};

/// Names in the text, in order; numbers such as 1e5 are none.
std::vector<Word> words_in(const std::string& text);

/// As written; muParser adds a blank.
std::string text_of(const mu::Parser& parser);

/// What is wrong with an expression, in words.
std::string fault_of(const mu::ParserError& error);

/// Gives the parser, whose variables and constants are defined, this text. Returns what is wrong with it, in words, and what is allowed; empty: nothing.
std::string parse(mu::Parser& parser, const std::string& text, const std::string& allowed_names);

}  // namespace perikit
