#include "new_project.hpp"

#include "data_folder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "output/recorder.hpp"

namespace perikit::app {

namespace {

namespace fs = std::filesystem;

/// Kinds with a template: a folder each, beside `common`.
std::vector<std::string> kinds_with_template(const fs::path& templates) {
  std::vector<std::string> kinds;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(templates, missing)) {
    if (entry.path().filename() != "common") kinds.push_back(entry.path().filename());
  }
  if (missing) throw InputError({templates.string()}, "", fmt::format("the templates cannot be read: {}", missing.message()));
  std::ranges::sort(kinds);
  return kinds;
}

/// "my_law" -> "MyLaw"
std::string pascal_case(const std::string& name) {
  std::string text;
  bool start = true;
  for (const char c : name) {
    if (c != '_') text += start ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    start = c == '_';
  }
  return text;
}

/// A name that registry, file system, C++ and CMake all take.
bool is_name(const std::string& text) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !text.empty() && letter(text.front()) && text.back() != '_' && text.find("__") == std::string::npos &&
         std::ranges::all_of(text, [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, from.size(), to);
}

std::string filled(const fs::path& file, const std::vector<std::pair<std::string, std::string>>& words) {
  std::ifstream stream(file);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  for (const auto& [from, to] : words) replace_all(text, from, to);
  return text;
}

}  // namespace

std::string new_project(const Registry& registry, const std::string& kind, const std::string& part, bool history) {
  const fs::path templates = data_folder() / "templates";
  const std::vector<std::string> kinds = kinds_with_template(templates);
  if (std::ranges::find(kinds, kind) == kinds.end()) {
    throw InputError(fmt::format("no template for kind '{}'{}; allowed: {}", kind, did_you_mean(kind, kinds), fmt::join(kinds, ", ")));
  }
  const fs::path with_history = templates / kind / "history";
  if (history && !fs::exists(with_history)) throw InputError(fmt::format("--history: found the kind '{}'; allowed: material", kind));
  if (!is_name(part))
    throw InputError(fmt::format("'{}' is no name of a part; allowed: a-z, 0-9 and single _ between them, a letter first", part));
  const Kind known = *kind_from_name(kind);
  if (registry.known(known, part)) {
    throw InputError(
        fmt::format("there is a {} '{}' already ({}): take another name", kind, part, registry.library_of(known, part).string()));
  }
  const fs::path folder = part;
  if (fs::exists(fs::symlink_status(folder))) throw InputError({folder.string()}, "", "exists already: nothing is written");
  std::error_code failed;
  if (fs::create_directory(folder, failed); failed) throw RunError(fmt::format("{}: cannot create the folder: {}", part, failed.message()));
  const std::string target = fmt::format("{}_{}", kind, part);
  // In this order: the longer words hold the shorter ones.
  const std::vector<std::pair<std::string, std::string>> words{{"kind_part_name", target},
                                                               {"kind/part_name", kind + "/" + part},
                                                               {"perikit_prefix", prefix().string()},
                                                               {"part_name", part},
                                                               {"PartName", pascal_case(part)}};
  for (const fs::path& source : {templates / "common", history ? with_history : templates / kind}) {
    for (const auto& entry : fs::directory_iterator(source))
      if (entry.is_regular_file()) write_file_atomically(folder / entry.path().filename(), filled(entry.path(), words));
  }
  // Its ctest runs the contract suites; a build folder builds them by itself where they are missing.
  const std::string first = fs::exists(contract_program()) || in_build_folder() ? "" : fmt::format("  {}\n", how_to_build_contract());
  return fmt::format("wrote {0}/: replace the default in {0}/plugin.cpp by your physics\n{1}"
                     "  cmake -S {0} -B {0}/build && cmake --build {0}/build && ctest --test-dir {0}/build --output-on-failure\n"
                     "  perikit run {0}/scene.toml --plugin-path {0}/build -o {0}/out\n", part, first);
}

}  // namespace perikit::app
