#pragma once
#include <string>
#include <vector>

namespace perikit {

/// Words that expressions take already (variables, pi, functions), so that [constants] cannot redefine them.
std::vector<std::string> expression_words();

}  // namespace perikit
