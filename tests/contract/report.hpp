#pragma once
/// What `perikit contract` prints: one line for each test case, and of a broken one what was found, with numbers, once for each check instead
/// of once for each of a thousand points.

namespace perikit::contract {

inline constexpr const char* report_name = "contract";   ///< doctest's name of it

/// Test cases of the last run.
unsigned cases_run() noexcept;

}  // namespace perikit::contract
