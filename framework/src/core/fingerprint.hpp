#pragma once
/// 64 bits in the manner of FNV-1a, eight bytes at a time: tells whether bytes are the same ones as before, added in the same pieces. No protection
/// against intent.

#include <cstddef>
#include <cstdint>
#include <cstring>
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
    for (; bytes.size() >= sizeof(std::uint64_t); bytes = bytes.subspan(sizeof(std::uint64_t))) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data(), sizeof word);
      mix(word);
    }
    for (const std::byte b : bytes) mix(static_cast<std::uint64_t>(b));
  }
  template <class T>
  void add(std::span<const T> values) noexcept {
    add(std::as_bytes(values));
  }
  /// 16 hexadecimal digits.
  std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  /// A product carries bits upwards alone: the upper half comes down again.
  void mix(std::uint64_t word) noexcept {
    hash_ = (hash_ ^ word) * 0x100000001b3u;
    hash_ ^= hash_ >> 32;
  }

  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

/// Of the bytes of a file; of none where it cannot be read.
Fingerprint fingerprint_of(const std::filesystem::path& file);

}  // namespace perikit
