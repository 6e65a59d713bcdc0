#include <csignal>

#include "perikit/plugin/abi.hpp"

/// Runs inside dlopen, before any symbol can be compared.
static const int crash = std::raise(SIGSEGV);

PERIKIT_PLUGIN(registrar) {
  (void)registrar;
}
