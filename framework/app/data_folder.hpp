#pragma once
#include <filesystem>

namespace perikit::app {

/// Where the program is installed, or its build folder.
inline std::filesystem::path prefix() { return std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path(); }

/// Files that come with the program.
inline std::filesystem::path data_folder() { return prefix() / PERIKIT_DATA; }

}  // namespace perikit::app
