#pragma once
/// What is said where something is refused.

#include <exception>
#include <string>

namespace perikit::test {

/// What a call throws; `otherwise` where it throws nothing.
template <class Error = std::exception, class Call>
std::string message_of(Call&& call, const std::string& otherwise = "") {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return otherwise;
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace perikit::test
