#include "perikit/core/simd.hpp"

#if defined(PERIKIT_COUNT_OPERATIONS)
std::uint64_t perikit::detail::operations = 0;
#endif
