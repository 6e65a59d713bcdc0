#include "perikit/core/library_beside.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>

namespace perikit {

void* made_by_library(const char* library, const char* factory, std::string& why) {
  Dl_info here{};
  dladdr(reinterpret_cast<const void*>(&made_by_library), &here);
  const std::string file = (std::filesystem::path(here.dli_fname ? here.dli_fname : "").parent_path() / library).string();
  void* const opened = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!opened) {
    why = fmt::format("{} cannot be opened: {}", file, dlerror());
    return nullptr;
  }
  using Factory = void* (*)(const char* build_id);
  const auto make = reinterpret_cast<Factory>(dlsym(opened, factory));
  void* const made = make ? make(PERIKIT_BUILD) : nullptr;
  if (!make)
    why = file + " is no library of perikit";
  else if (!made)
    why = fmt::format("{} belongs to another perikit than this one ({})", file, PERIKIT_BUILD);
  return made;
}

}  // namespace perikit
