#pragma once
// Values that a parameter must not take, made from its entry in a parameter table.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "perikit/plugin/parameters.hpp"

namespace perikit::test {

/// A value that is refused: the fault lies at `fault` within it (an element of a list), and `key` is what follows the key there.
struct SpoiledValue {
  std::string value;
  std::string fault = {};  ///< empty: the whole value
  std::string key = {};    ///< ".1" for the second element
  std::string hint = {};   ///< what the message must also hold
};

/// Of a word, with two letters exchanged or one doubled.
inline std::string misspelt(const std::string& word) {
  for (std::size_t k = 1; k + 1 < word.size(); ++k)
    if (word[k] != word[k + 1]) return word.substr(0, k) + word[k + 1] + word[k] + word.substr(k + 2);
  return word + word.back();
}

inline std::string quoted(const std::string& text) {
  return "\"" + text + "\"";
}

/// Numbers outside of the range, with their type's text.
inline std::vector<std::string> out_of_range(const Parameter& p) {
  std::vector<std::string> values;
  const bool whole = p.type == ParameterType::integer || p.type == ParameterType::integers;
  const auto add = [&](double v) { values.push_back(whole ? fmt::format("{:.0f}", v) : fmt::format("{:.1f}", v)); };
  if (std::isfinite(p.lower)) add(p.lower - (p.lower_open && !whole ? 0.0 : 1.0));
  if (std::isfinite(p.upper)) add(p.upper + (p.upper_open ? 0.0 : 1.0));
  if (!whole) values.insert(values.end(), {"nan", "inf", "-inf"});
  return values;
}

/// One value for each way to spoil the parameter, in a body of two dimensions.
inline std::vector<SpoiledValue> spoiled(const Parameter& p) {
  using Type = ParameterType;
  std::vector<SpoiledValue> bad;
  const auto each = [&](const std::vector<std::string>& values) {
    for (const std::string& v : values) bad.push_back({v});
  };
  const auto pair = [&](const std::string& good, const std::string& wrong) {
    bad.push_back({fmt::format("[{}, {}]", good, wrong), wrong, ".1"});
  };
  const std::string bad_expression = "\"1 + wrong_name\"";
  switch (p.type) {
    case Type::number:
      each({"\"one\"", "true", "[1]", "{ a = 1 }", "2001-01-01"});
      each(out_of_range(p));
      break;
    case Type::integer:
      each({"1.0", "\"one\"", "false", "[1]"});
      each(out_of_range(p));
      break;
    case Type::boolean:
      each({"1", "\"true\"", "[true]"});
      break;
    case Type::text:
      each({"3", "true", "[\"a\"]"});
      break;
    case Type::choice:
      bad.push_back({quoted(misspelt(p.choices.front())), "", "",
                     p.choices.front().size() > 3 ? "did you mean '" + p.choices.front() + "'" : ""});
      each({"3", "true", "\"\""});
      break;
    case Type::expression:
    case Type::component:
      each({"true", "[1]", "\"x +\"", "\"(x\"", "\"x = 1\"", "\"\"", "\"sin(x, y)\"", bad_expression});
      if (!p.time) each({"\"t\""});
      each(out_of_range(p));
      break;
    case Type::expressions:
    case Type::components:
      each({"1", "true", "[1]", "[1, 1, 1]", "[]"});
      for (const char* wrong : {"true", "\"x +\"", "\"1 + wrong_name\"", "nan"}) pair("0", wrong);
      break;
    case Type::numbers:
      each({"1", "\"1\"", "true"});
      for (const std::string& v : out_of_range(p)) pair("0.5", v);
      pair("0.5", "\"a\"");
      if (p.per_axis)
        each({"[1]", "[1, 1, 1]"});
      else if (p.min_length > 0)
        each({"[]"});
      break;
    case Type::integers:
      each({"1", "\"1\""});
      for (const std::string& v : out_of_range(p)) pair("0", v);
      pair("0", "1.0");
      if (p.min_length > 0) each({"[]"});
      break;
    case Type::texts:
      each({"\"a\"", "1"});
      pair(quoted(p.choices.empty() ? "left" : p.choices.front()), "3");
      if (!p.choices.empty())
        bad.push_back({fmt::format("[{}]", quoted(misspelt(p.choices.front()))), quoted(misspelt(p.choices.front())), ".0",
                       "did you mean"});
      if (p.min_length > 0) each({"[]"});
      break;
    case Type::points:
      each({"1", "[]"});
      if (p.min_length > 1) each({"[[0, 0]]"});
      if (p.min_length == 2) {
        bad.push_back({"[[0, 0], [7]]", "[7]", ".1"});
        bad.push_back({"[[0, 0], [1, nan]]", "nan", ".1.1"});
      }
      break;
    case Type::part:
      each({"3", "true", "\"\"", "{ }", "{ type = 3 }"});
      break;
  }
  // The type of an empty table, or of a table with a bad type, is its key `type`.
  for (SpoiledValue& v : bad) {
    if (p.type == Type::part && v.value == "{ }") v.key = ".type";
    if (p.type == Type::part && v.value == "{ type = 3 }") v = {v.value, "3", ".type"};
  }
  return bad;
}

}  // namespace perikit::test
