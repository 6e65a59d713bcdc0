#pragma once
/// How much memory there is, for refusing what cannot be held before it is allocated.

namespace perikit {

/// Memory that this process may fill [bytes]: the least of the machine's, the container's and the shell's limit.
double memory_limit() noexcept;

}  // namespace perikit
