/// Any text is an expression with finite values, or is refused with InputError.

#include <cmath>
#include <string>

#include "scene/expressions/expression.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const Expression expression(text, {{"w", 2.0}}, true, {}, "key");
    for (const double x : {0.0, -1.5, 1e300}) {
      if (!std::isfinite(expression({x, 2 * x, 0.5}, x))) __builtin_trap();
    }
  } catch (const InputError&) {
  }
  return 0;
}
