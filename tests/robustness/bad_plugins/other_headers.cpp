#include "perikit/plugin/abi.hpp"

PERIKIT_EXPORT int perikit_abi_version() {
  return PERIKIT_ABI_VERSION;
}
PERIKIT_EXPORT const char* perikit_build_id() {
  return PERIKIT_TOOLCHAIN_ID " headers-000000000000";
}
PERIKIT_EXPORT void perikit_register(void*) {
  __builtin_trap();
}  // must not be reached
