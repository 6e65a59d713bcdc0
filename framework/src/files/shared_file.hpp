#pragma once
/// A file that one process has made and several write, each of them its own bytes of it.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "files/atomic_file.hpp"

namespace perikit {

class SharedFile {
 public:
  /// The file must be there.
  explicit SharedFile(std::filesystem::path file);
  /// Why this process may not write its bytes of it, in words; empty: it may. Network file systems whose machines keep pages to
  /// themselves (NFS, SMB) lose bytes where two of them write to one page.
  const std::string& refusal() const noexcept { return refusal_; }
  /// Numbers as they are in memory, low byte first.
  void write(std::uint64_t at, std::span<const double> values) noexcept;
  /// All of it is on the disk, or the first thing that went wrong, in words.
  std::string close() noexcept;

 private:
  std::filesystem::path file_;
  Descriptor descriptor_;
  std::string refusal_;
  int error_ = 0;
};

}  // namespace perikit
