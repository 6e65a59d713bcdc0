#pragma once
/// Errors a user can cause (InputError), errors of a run (RunError), and the search for the name that was meant.

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace perikit {

/// A place in an input file; line 0 means "the file as a whole" (or the command line when `file` is empty too).
struct SourcePosition {
  std::string file;
  int line = 0;
  int column = 0;
};

/// Something in the input is wrong. `what()` is the whole message: "file:line:column: key: what was found; what is allowed".
/// The program ends with exit status 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
  InputError(const SourcePosition& position, std::string_view key, std::string_view message);
};

/// A run that was well posed on paper failed (inadmissible deformation, no convergence, no disk space). Exit status 1.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Several input errors at once, sorted by position, one per line.
class InputErrors : public InputError {
 public:
  explicit InputErrors(std::vector<std::string> messages);
  const std::vector<std::string>& messages() const noexcept { return messages_; }

 private:
  std::vector<std::string> messages_;
};

/// The candidate nearest to `name` by edit distance; empty when none is near enough to be a likely slip of the pen.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// "; did you mean 'X'?", or what there is for a word of other programs, or "" - for the end of a message about an unknown name.
std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace perikit
