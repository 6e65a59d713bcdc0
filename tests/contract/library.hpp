#pragma once
#include <filesystem>

namespace perikit::contract {

/// Runs the suite of its kind on every part of an opened library, each in a process of its own, so that a crash is the fault of one
/// part; prints which parts keep their contract and which test cases the others break. 0: all keep it, 1: not.
int run_library(const std::filesystem::path& library, int argc, char** argv);

}  // namespace perikit::contract
