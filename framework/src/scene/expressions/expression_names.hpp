#pragma once
#include <string>
#include <vector>

namespace perikit {

/// Words that expressions take already (variables, pi, functions), so that [constants] cannot redefine them.
std::vector<std::string> expression_words();

/// Names in the text of an expression, in order.
std::vector<std::string> names_of_expression(const std::string& text);

}  // namespace perikit
