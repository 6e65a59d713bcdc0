#pragma once
/// Files that end with a fingerprint of themselves. The HDF5 library may crash on a damaged file: a seal is looked at before it opens one.

#include <cstdint>
#include <filesystem>

namespace perikit {

/// Adds the seal to a file of so many bytes, open for reading and writing. What an HDF5 file has behind its end disturbs no
/// reader of it. Returns the system's error code.
int seal(int descriptor, std::uint64_t size);

/// Whether the file is byte for byte what it was when it was sealed. Throws InputError where it cannot be read.
bool seal_holds(const std::filesystem::path& file);

}  // namespace perikit
