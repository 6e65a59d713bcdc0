#pragma once
/// Files that are either whole or not there: write to a temporary name in the same folder, fsync, rename, fsync the folder.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace perikit {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) noexcept : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int get() const noexcept { return value_; }
  explicit operator bool() const noexcept { return value_ >= 0; }
  int release() noexcept;

 private:
  int value_;
};

/// A file that is being written under its temporary name; unless it is kept, nothing of it stays. Methods throw RunError with the
/// file's name and the system's reason; an earlier file of the name is then untouched.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path file);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();
  int descriptor() const noexcept { return descriptor_.get(); }
  const std::filesystem::path& temporary() const noexcept { return temporary_; }
  /// Nothing where the system's code is 0.
  void check(int code) const;
  void keep();

 private:
  std::filesystem::path file_, temporary_;
  Descriptor descriptor_;
  bool kept_ = false;
};

/// Replaces `file` by `bytes`, then `more`. Throws RunError with the file's name and the system's reason; an earlier `file` is
/// then untouched.
void store_atomically(const std::filesystem::path& file, std::span<const std::byte> bytes, std::span<const std::byte> more = {});

/// Creates a folder with those above it; removes a file if it is there. Throw RunError.
void make_folder(const std::filesystem::path& folder);
void remove_file(const std::filesystem::path& file);

/// The whole file; empty where it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// The name under which this process writes `file` before it renames it.
std::filesystem::path temporary_name(const std::filesystem::path& file);
/// The name of the file that a file of this name is the temporary of, of whatever process; empty where it is none.
std::string file_of_temporary(const std::string& name);

/// RunError "FILE: ACTION: reason of the system's error code".
[[noreturn]] void throw_system_error(const std::filesystem::path& file, const std::string& action, int code);

/// write(2) until all bytes are out; 0 or the system's error code.
int write_all(int descriptor, std::span<const std::byte> bytes) noexcept;

}  // namespace perikit
