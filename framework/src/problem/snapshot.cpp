#include "problem/snapshot.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "perikit/core/errors.hpp"

namespace perikit {

void ByteWriter::bytes(const void* data, std::size_t size) {
  constexpr std::size_t piece = std::size_t{1} << 20;
  const auto* from = static_cast<const std::byte*>(data);
  if (drain_ && bytes_.size() + size > piece) finish();
  if (drain_ && size > piece) return drain_({from, size});
  bytes_.insert(bytes_.end(), from, from + size);
}

void ByteWriter::finish() {
  drain_(bytes_);
  bytes_.clear();
}

void ByteWriter::text(const std::string& text) {
  value(static_cast<std::uint64_t>(text.size()));
  bytes(text.data(), text.size());
}

void ByteWriter::numbers(std::span<const double> values) {
  value(static_cast<std::uint64_t>(values.size()));
  bytes(values.data(), values.size_bytes());
}

void ByteReader::bytes(void* to, std::size_t size) {
  expect(size, 1);
  for (auto* at = static_cast<std::byte*>(to); size > 0;) {
    if (bytes_.empty()) {
      piece_ = next_();
      if (piece_.empty() || piece_.size() > later_) throw InputError("the saved state is too short");
      later_ -= piece_.size();
      bytes_ = piece_;
    }
    const std::size_t part = std::min(size, bytes_.size());
    std::memcpy(at, bytes_.data(), part);
    bytes_ = bytes_.subspan(part);
    at += part;
    size -= part;
  }
}

void ByteReader::expect(std::uint64_t count, std::size_t size) const {
  if (count > (bytes_.size() + later_) / size) throw InputError("the saved state is too short");
}

std::string ByteReader::text() {
  const auto length = value<std::uint64_t>();
  if (length > 256) throw InputError("the saved state is damaged");
  std::string text(length, ' ');
  bytes(text.data(), length);
  return text;
}

}  // namespace perikit
