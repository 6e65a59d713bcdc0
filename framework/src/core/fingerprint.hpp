#pragma once
/// FNV-1a, 64 bits: tells whether bytes are the same ones as before. No protection against intent.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include <fmt/format.h>

namespace perikit {

class Fingerprint {
 public:
  Fingerprint() noexcept = default;
  /// Goes on from the value of another.
  explicit Fingerprint(std::uint64_t value) noexcept : hash_(value) {}
  std::uint64_t value() const noexcept { return hash_; }
  void add(std::span<const std::byte> bytes) noexcept {
    for (const std::byte b : bytes) hash_ = (hash_ ^ static_cast<std::uint64_t>(b)) * 0x100000001b3u;
  }
  template <class T>
  void add(std::span<const T> values) noexcept {
    add(std::as_bytes(values));
  }
  /// 16 hexadecimal digits.
  std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

/// Of the bytes of a file; of none where it cannot be read.
Fingerprint fingerprint_of(const std::filesystem::path& file);

}  // namespace perikit
