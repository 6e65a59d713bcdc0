#pragma once
/// Where HDF5 writes a new file: straight to a descriptor. What the system refuses is kept for the caller and HDF5 hears of no failure,
/// because it is never done with a file that it cannot flush.

#include <hdf5.h>

namespace perikit::hdf5 {

/// Of a file that is being written; must outlive it.
struct Target {
  int descriptor = -1;   ///< of an empty file, for reading and writing
  int error = 0;         ///< the system's code for the first write that failed
  hsize_t size = 0;      ///< [bytes] of the whole file, after it was closed
};

/// From now on files that are created with these access properties are written to `target`, whatever their name. False: HDF5 cannot.
bool write_to(Target& target, hid_t access);

}  // namespace perikit::hdf5
