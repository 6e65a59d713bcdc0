#pragma once
/// A file that holds the input of one run.

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

/// In memory where there is such a folder: thousands of files.
inline std::filesystem::path input_path(const char* extension) {
  const std::filesystem::path memory = "/dev/shm";
  return (std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path()) / ("perikit_fuzz_" + std::to_string(getpid()) + extension);
}

/// Gone with the process.
struct InputFile {
  explicit InputFile(const char* extension) : path(input_path(extension)) {}
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::filesystem::path path;
};

struct InputFolder : InputFile {
  InputFolder() : InputFile("") { std::filesystem::create_directory(path); }
};

inline std::filesystem::path input_file(const unsigned char* data, std::size_t size, const char* extension) {
  static const InputFile file(extension);
  std::ofstream(file.path, std::ios::binary | std::ios::trunc).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return file.path;
}
