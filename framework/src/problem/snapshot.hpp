#pragma once
/// Run state as bytes, and back.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace perikit {

class ByteWriter {
 public:
  ByteWriter() = default;
  /// What is written goes on to `drain`, a piece at a time, the last one with finish().
  explicit ByteWriter(std::function<void(std::span<const std::byte>)> drain) : drain_(std::move(drain)) {}
  void finish();
  void bytes(const void* data, std::size_t size);
  template <class T>
  void value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(&value, sizeof value);
  }
  void text(const std::string& text);
  /// Their number, and they.
  void numbers(std::span<const double> values);
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
  std::function<void(std::span<const std::byte>)> drain_;  ///< null: all stays here
};

/// Throws InputError where the bytes end too early, or hold what was never written.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  /// Of so many bytes, which come a piece at a time, each when all before it has been read.
  ByteReader(std::uint64_t size, std::function<std::vector<std::byte>()> next) : later_(size), next_(std::move(next)) {}
  void bytes(void* to, std::size_t size);
  template <class T>
  T value() {
    T v;
    bytes(&v, sizeof v);
    return v;
  }
  /// Throws where fewer than count entries of this size are left.
  void expect(std::uint64_t count, std::size_t size) const;
  /// At most 256 characters.
  std::string text();
  bool done() const noexcept { return bytes_.empty() && later_ == 0; }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t later_ = 0;  ///< bytes that have not come
  std::function<std::vector<std::byte>()> next_;
  std::vector<std::byte> piece_;
};

}  // namespace perikit
