#include "perikit/plugin/abi.hpp"

PERIKIT_PLUGIN(registrar) {
  (void)registrar;
  throw 42;
}
