/// Any text is a manifest, or is refused with InputError.

#include "file.hpp"
#include "perikit/core/errors.hpp"
#include "plugin/manifest.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  try {
    const Manifest manifest = read_manifest(input_file(data, size, ".parts"));
    for (const NamedPart& part : manifest.parts)
      if (part.name.empty()) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
