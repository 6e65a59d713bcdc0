#pragma once
/// What is said to whoever started the program.

#include <string_view>

namespace perikit {

/// To standard error, at once. What cannot be written there is lost, and nothing else: nobody is left to be told.
void tell(std::string_view text) noexcept;

}  // namespace perikit
