/// Any text is a scene that reads back as itself, or is refused with InputError.

#include <string>

#include "scene/scene.hpp"
#include "unit/fake_catalogue.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  static test::FakeCatalogue parts;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const Scene scene = parse_scene(text, "fuzz.toml", parts);
    const Scene again = parse_scene(scene.resolved, "resolved.toml", parts);
    if (again.resolved != scene.resolved) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
