#pragma once
/// Run state as bytes, and back.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace perikit {

class ByteWriter {
 public:
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
};

/// Throws InputError where the bytes end too early, or hold what was never written.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
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
  bool done() const noexcept { return bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace perikit
