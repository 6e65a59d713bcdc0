#pragma once
/// Opening one shared library: the checks before, during and after dlopen.

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "perikit/plugin/part.hpp"
#include "plugin/manifest.hpp"

namespace perikit {

/// Why a library is refused; `what()` is the reason alone, without the file.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws Refusal unless `file` is a regular file, ELF, and as long as its headers say. (A truncated library raises SIGBUS inside
/// the loader, which nothing can catch.)
void check_file(const std::filesystem::path& file);

/// Throws Refusal unless a library of this ABI version and build id fits this program.
void check_abi(int version, const std::string& build_id);

/// Loads `file` for good, compares its C symbols and calls its registration function. Throws Refusal.
void load_library(const std::filesystem::path& file, Registrar& registrar);

/// Loads and registers `file` in a child process, and returns what it registers, summaries left out. Throws Refusal where the child
/// refuses it or does not come to its own end: a file damaged inside, a library that crashes or exits in its static constructors or
/// its registration, no process to be had.
std::vector<NamedPart> probe_library(const std::filesystem::path& file);

/// From now on a crash of this process ends it with status 1 and a message that names `file`, and all others for which this was called:
/// libraries whose bytes no manifest vouches for. Without such a library signals are left alone.
void suspect_in_crashes(const std::filesystem::path& file);

}  // namespace perikit
