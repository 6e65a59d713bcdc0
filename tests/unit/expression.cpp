#include "scene/expressions/expression.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include "scene/expressions/expression_names.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

const Constants constants{{"w", 48.0}, {"E0", 2.0}};

Expression timed(const std::string& text) {
  return Expression(text, constants, true, {"bar.toml", 3, 5}, "load.0.force");
}
double at(const std::string& text, std::array<double, 3> x = {2, 3, 5}, double t = 0.5) {
  return timed(text)(x, t);
}

}  // namespace

TEST_CASE("a number is a number") {
  CHECK(Expression(2.5).is_number());
  CHECK(Expression(2.5)({1, 2, 3}) == 2.5);
  CHECK(Expression()({}) == 0.0);
  CHECK(Expression(std::variant<double, std::string>(4.0), {}, false, {}, "").is_number());
}

TEST_CASE("operators, comparisons and functions") {
  const double pi = std::acos(-1.0);
  CHECK(at("x + y*z - 1") == 16.0);
  CHECK(at("x^y") == 8.0);
  CHECK(at("2^3^2") == 512.0);
  CHECK(at("-x^2") == -4.0);
  CHECK(at("x < y && y < z") == 1.0);
  CHECK(at("x > y || y == 3") == 1.0);
  CHECK(at("x != 2") == 0.0);
  CHECK(at("x >= 2 ? 7 : 9") == 7.0);
  CHECK(at("sin(pi/2) + cos(pi)") == doctest::Approx(0.0));
  CHECK(at("atan2(y, x)") == doctest::Approx(std::atan2(3, 2)));
  CHECK(at("sqrt(abs(-4)) + exp(0) + tanh(0)") == doctest::Approx(3.0));
  CHECK(at("log(exp(2)) + ln(exp(3)) + log10(100)") == doctest::Approx(7.0));
  CHECK(at("min(x, y, z) + max(x, y)") == 5.0);
  CHECK(at("floor(2.7) + ceil(2.2) + pow(2, 3)") == 13.0);
  CHECK(at("w/E0") == 24.0);
  CHECK(at("1e-3*1E+3 + 2.5e0") == doctest::Approx(3.5));
  CHECK(at("pi") == doctest::Approx(pi));
}

TEST_CASE("an expression knows what it depends on") {
  CHECK(timed("3*t").depends_on_time());
  CHECK(!timed("3*t").depends_on_position());
  CHECK(!timed("tan(x)").depends_on_time());
  CHECK(timed("tan(x)").depends_on_position());
  CHECK(!timed("w").depends_on_position());
  CHECK(!timed("w").is_number());
}

TEST_CASE("copies give the same values") {
  const Expression first = timed("x + t");
  const Expression copy = first;
  CHECK(copy({1, 0, 0}, 2) == 3.0);
  CHECK(first({4, 0, 0}, 2) == 6.0);
}

TEST_CASE("bad expressions are refused with place and reason") {
  const std::pair<const char*, const char*> cases[]{{"x +", "ends too early"},
                                                    {"(x", "closing parenthesis is missing"},
                                                    {"", "empty"},
                                                    {"foo(x)", "unknown name 'foo' at character 1"},
                                                    {"x + ww", "did you mean 'w'?"},
                                                    {"sni(x)", "did you mean 'sin'?"},
                                                    {"x = 1", "'=' at character 3"},
                                                    {"x, y", "several values"},
                                                    {"x ? 1", "'?' without ':'"},
                                                    {"sin(1, 2)", "too many arguments"},
                                                    {"atan2(1)", "too few arguments"},
                                                    {"2 x", "unexpected"},
                                                    {"x & y", "unexpected"},
                                                    {"\"abc\"", "allowed"},
                                                    {"_pi", "unknown name '_pi'"},
                                                    {"x > 0 and y > 0", "unknown name 'and'"},
                                                    {"x))", "unexpected"},
                                                    {"\xc3\xa9 + 1", "unexpected"}};
  for (const auto& wrong : cases) {
    CAPTURE(wrong.first);
    const std::string message = message_of([&] { timed(wrong.first); });
    CAPTURE(message);
    CHECK(contains(message, "bar.toml:3:5: load.0.force: found the expression"));
    CHECK(contains(message, wrong.second));
  }
  CHECK(contains(message_of([] {
                   Expression(std::string("x*t"), {}, false, {"a", 1, 1}, "k");
                 }),
                 "t is not allowed here; allowed: x, y, z, pi"));
}

TEST_CASE("values that are not finite name key and point") {
  const Expression inverse = timed("1/x");
  CHECK(inverse({2, 0, 0}) == 0.5);
  const std::string message = message_of([&] { (void)inverse({0, 1, 2}, 3); });
  CHECK(contains(message, "bar.toml:3:5: load.0.force"));
  CHECK(contains(message, "is inf at x = (0, 1, 2), t = 3"));
  CHECK(contains(message_of([] { (void)at("sqrt(-1)"); }), "nan"));
  CHECK(contains(message_of([] { (void)at("log(-x)"); }), "nan"));
}

TEST_CASE("the page on expressions names every word, and its examples have the values that it says") {
  std::ifstream file(std::string(PERIKIT_SOURCE_FOLDER) + "/framework/docs/expressions.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  for (const std::string& word : expression_words()) {
    const bool named = page.find("`" + word + "`") != std::string::npos || page.find("`" + word + "(") != std::string::npos;
    CHECK_MESSAGE(named, word);
  }
  std::size_t examples = 0;
  std::istringstream lines(page.substr(page.find("## Examples")));
  for (std::string line; std::getline(lines, line);) {
    std::smatch row;
    if (!std::regex_match(line, row, std::regex(R"(\| `(.+)` \| (\S+) \| .*)"))) continue;
    const std::string text = std::regex_replace(row[1].str(), std::regex(R"(\\\|)"), "|");   // a bar in a Markdown table
    const Expression example(text, {{"L", 10.0}, {"dx", 0.5}}, true, {}, "");
    CHECK_MESSAGE(example({2, 3, 5}, 0.5) == doctest::Approx(std::stod(row[2].str())).epsilon(1e-12), text);
    ++examples;
  }
  CHECK(examples == 14);
}
