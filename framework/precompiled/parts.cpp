// Holds nothing: CMake precompiles parts.hpp for a target that has a file.
