#include "problem/snapshot.hpp"

#include <cstdint>
#include <cstring>

#include "perikit/core/errors.hpp"

namespace perikit {

void ByteWriter::bytes(const void* data, std::size_t size) {
  const auto* from = static_cast<const std::byte*>(data);
  bytes_.insert(bytes_.end(), from, from + size);
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
  if (size > bytes_.size()) throw InputError("the saved state is too short");
  if (size > 0) std::memcpy(to, bytes_.data(), size);  // an empty span may point nowhere
  bytes_ = bytes_.subspan(size);
}

void ByteReader::expect(std::uint64_t count, std::size_t size) const {
  if (count > bytes_.size() / size) throw InputError("the saved state is too short");
}

std::string ByteReader::text() {
  const auto length = value<std::uint64_t>();
  if (length > 256) throw InputError("the saved state is damaged");
  std::string text(length, ' ');
  bytes(text.data(), length);
  return text;
}

}  // namespace perikit
