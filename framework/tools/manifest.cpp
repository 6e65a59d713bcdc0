/// perikit-manifest FILE.so: opens a library as the program would, and writes the manifest beside it; an older one says nothing of this file.

#include "plugin/manifest.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>

#include "plugin/registry.hpp"

int main(int argc, char** argv) try {
  if (argc != 2) {
    fmt::print(stderr, "usage: perikit-manifest FILE.so\n");
    return 2;
  }
  std::filesystem::remove(perikit::manifest_path(argv[1]));
  perikit::Registry registry;
  registry.open(argv[1]);
  std::vector<perikit::NamedPart> parts;
  for (const auto& [kind, name] : registry.parts_of(argv[1]))
    parts.push_back({kind, name, registry.describe(kind, name).summary});
  perikit::write_manifest(argv[1], parts);
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 2;
}
