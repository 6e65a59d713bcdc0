#pragma once
/// Files that end with a fingerprint of themselves. The HDF5 library may crash on a damaged file: a seal is looked at before it opens one.

#include <cstddef>
#include <filesystem>
#include <span>

namespace perikit {

/// store_atomically, with the seal after the bytes. What an HDF5 file has behind its end disturbs no reader of it.
void store_sealed(const std::filesystem::path& file, std::span<const std::byte> bytes);

/// Whether the file is byte for byte what store_sealed wrote. Throws InputError where it cannot be read.
bool seal_holds(const std::filesystem::path& file);

}  // namespace perikit
