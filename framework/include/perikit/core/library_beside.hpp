#pragma once
/// Libraries of perikit that know what the framework and serial parts do not (MPI, PETSc). They lie beside the framework's own library, and are
/// opened only by those runs that need them.

#include <string>

namespace perikit {

/// What the function `factory` of that library has made, for its only caller: extern "C" Product* factory(const char* build_id), null where the
/// caller is of another build. The library is never closed. Null where nothing was made, and `why` <- why, with the file.
void* made_by_library(const char* library, const char* factory, std::string& why);

}  // namespace perikit
