#include <csignal>

#include "perikit/plugin/abi.hpp"

/// Stops the process that asks what it brings.
PERIKIT_PLUGIN(registrar) {
  (void)registrar;
  std::raise(SIGSTOP);
}
