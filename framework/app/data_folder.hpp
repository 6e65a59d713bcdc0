#pragma once
#include <filesystem>
#include <string>

namespace perikit::app {

/// Where the program is installed, or its build folder.
inline std::filesystem::path prefix() { return std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path(); }

/// Files that come with the program.
inline std::filesystem::path data_folder() { return prefix() / PERIKIT_DATA; }

/// The contract suites, a program of their own beside this one; a build without tests leaves it out until it is asked for.
inline std::filesystem::path contract_program() { return std::filesystem::read_symlink("/proc/self/exe").replace_filename("perikit-contract"); }

/// Whether this program lies in its build folder, which can build the suites.
inline bool in_build_folder() { return std::filesystem::exists(prefix() / "CMakeCache.txt"); }

/// The command that brings the contract suites where they are missing.
inline std::string how_to_build_contract() {
  const std::string target = "--target perikit_contract";
  if (in_build_folder()) return "cmake --build " + prefix().string() + " " + target;
  return "in the folder that perikit was built in, cmake --build . " + target + ", and install it again";
}

}  // namespace perikit::app
