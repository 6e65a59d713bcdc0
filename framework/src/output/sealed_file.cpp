#include "output/sealed_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "core/fingerprint.hpp"
#include "files/atomic_file.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

std::string seal_of(const Fingerprint& fingerprint) { return fmt::format("\nperikit seal {}\n", fingerprint.text()); }

}  // namespace

void store_sealed(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  Fingerprint fingerprint;
  fingerprint.add(bytes);
  const std::string seal = seal_of(fingerprint);
  store_atomically(file, bytes, std::as_bytes(std::span(seal)));
}

bool seal_holds(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) throw InputError({file.string()}, "", fmt::format("cannot be read: {}", std::generic_category().message(errno)));
  const std::streamoff length = static_cast<std::streamoff>(seal_of({}).size());
  std::streamoff rest = static_cast<std::streamoff>(stream.tellg()) - length;
  if (rest < 0) return false;
  stream.seekg(0);
  Fingerprint fingerprint;
  std::vector<char> piece(std::size_t{1} << 20);
  for (; rest > 0; rest -= stream.gcount()) {
    stream.read(piece.data(), std::min(rest, static_cast<std::streamoff>(piece.size())));
    if (stream.gcount() <= 0) return false;
    fingerprint.add(std::span<const char>(piece.data(), static_cast<std::size_t>(stream.gcount())));
  }
  std::string seal(static_cast<std::size_t>(length), '\0');
  stream.read(seal.data(), length);
  return stream.gcount() == length && seal == seal_of(fingerprint);
}

}  // namespace perikit
