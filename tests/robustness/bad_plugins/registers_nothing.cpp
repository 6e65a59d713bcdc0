#include "perikit/plugin/abi.hpp"

PERIKIT_PLUGIN(registrar) {
  (void)registrar;
}
