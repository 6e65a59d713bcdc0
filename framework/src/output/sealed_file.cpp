#include "output/sealed_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

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

int seal(int descriptor, std::uint64_t size) {
  Fingerprint fingerprint;
  std::vector<std::byte> piece(std::size_t{1} << 20);
  for (std::uint64_t at = 0; at < size;) {
    // Whole pieces, in which the fingerprint is taken again.
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), size - at));
    for (std::size_t got = 0; got < wanted;) {
      const ssize_t count = ::pread(descriptor, piece.data() + got, wanted - got, static_cast<off_t>(at + got));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return count < 0 ? errno : EIO;
      got += static_cast<std::size_t>(count);
    }
    fingerprint.add(std::span<const std::byte>(piece).first(wanted));
    at += wanted;
  }
  const std::string text = seal_of(fingerprint);
  if (::lseek(descriptor, static_cast<off_t>(size), SEEK_SET) < 0) return errno;
  return write_all(descriptor, std::as_bytes(std::span(text)));
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
