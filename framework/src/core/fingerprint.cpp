#include "core/fingerprint.hpp"

#include <array>
#include <fstream>

namespace perikit {

Fingerprint fingerprint_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 1 << 16> buffer;
  Fingerprint fingerprint;
  do {
    in.read(buffer.data(), buffer.size());
    fingerprint.add(std::span<const char>(buffer.data(), static_cast<std::size_t>(in.gcount())));
  } while (in);
  return fingerprint;
}

}  // namespace perikit
