#include <unistd.h>

#include <csignal>

#include "perikit/plugin/abi.hpp"

/// Never says what it brings, and does not listen.
PERIKIT_PLUGIN(registrar) {
  (void)registrar;
  for (const int signal : {SIGALRM, SIGTERM, SIGINT}) std::signal(signal, SIG_IGN);
  for (;;) ::pause();
}
