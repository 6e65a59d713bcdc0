#include "perikit/plugin/abi.hpp"

extern "C" void perikit_symbol_of_a_later_version();
PERIKIT_PLUGIN(registrar) {
  (void)registrar;
  perikit_symbol_of_a_later_version();
}
