// Holds nothing: CMake precompiles library.hpp for a target that has a file.
