#pragma once
/// Manifests: beside X.so lies X.parts, TOML text that names its parts, so that names are known without opening the library.
///
///   format = 1
///   abi = 1
///   build_id = "gcc12 libstdc++-cxx11abi1 x86-64-v4 simd512 headers-0123456789ab"
///   size = 48216                       # of the library [bytes]
///   checksum = "ab12..."               # Fingerprint of the library
///   part = [ { kind = "material", name = "neo_hookean", summary = "..." } ]

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "perikit/plugin/parameters.hpp"

namespace perikit {

struct NamedPart {
  Kind kind;
  std::string name, summary;
};

struct Manifest {
  int abi = 0;
  std::string build_id;
  std::uintmax_t size = 0;
  std::string checksum;
  std::vector<NamedPart> parts;

  /// Whether `library` has the size of the file that this manifest was written for: all that is looked at before it is opened.
  bool matches_size(const std::filesystem::path& library) const;
  /// Whether `library` is, byte for byte, that file. Reads all of it.
  bool matches(const std::filesystem::path& library) const;
};

/// X.so -> X.parts
std::filesystem::path manifest_path(const std::filesystem::path& library);

/// Throws InputError naming file and place for anything that is not a complete manifest.
Manifest read_manifest(const std::filesystem::path& file);

/// Writes the manifest of a library of this program's ABI, by a temporary name of its own and a rename. Throws RunError.
void write_manifest(const std::filesystem::path& library, const std::vector<NamedPart>& parts);

}  // namespace perikit
