#include "scene/scene.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "files/toml_limits.hpp"
#include "scene/scene_reader.hpp"
#include "scene/toml/overrides.hpp"

namespace perikit {

namespace {

std::string read_text(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& what) {
    return InputErrors({InputError({file.string(), 0, 0}, "", what + "; allowed: a readable scene file").what()});
  };
  std::error_code failure;
  const auto status = std::filesystem::status(file, failure);
  if (!std::filesystem::exists(status))
    throw refuse(failure && failure != std::errc::no_such_file_or_directory ? failure.message() : "does not exist");
  if (std::filesystem::is_directory(status)) throw refuse("is a folder");
  if (!std::filesystem::is_regular_file(status)) throw refuse("is not a regular file");
  if (const auto size = std::filesystem::file_size(file, failure); !failure && size > largest_toml)
    throw refuse(fmt::format("has {} bytes, more than {}", size, largest_toml));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw refuse(fmt::format("cannot be opened ({})", std::strerror(errno)));
  std::ostringstream text;
  if (stream.peek() != std::ifstream::traits_type::eof()) text << stream.rdbuf();
  if (stream.bad() || text.fail()) throw refuse("cannot be read");
  return text.str();
}

toml::table parse_or_report(const std::string& text, const std::string& file) {
  try {
    return parse_toml(text, file);
  } catch (const InputError& error) {
    throw InputErrors({error.what()});
  }
}

}  // namespace

Scene read_scene(const std::filesystem::path& file, PartCatalogue& parts, const SceneOptions& options) {
  return parse_scene(read_text(file), file, parts, options);
}

Scene parse_scene(const std::string& text, const std::filesystem::path& file, PartCatalogue& parts, const SceneOptions& options) {
  toml::table root = parse_or_report(text, file.string());
  if (root.empty()) throw InputErrors({InputError({file.string(), 0, 0}, "", "found an empty file; allowed: a scene").what()});
  SceneReader reader(parts, file, options.trust);
  for (const std::string& assignment : options.overrides) apply_override(root, assignment, reader.errors());
  reader.read(root);
  reader.errors().raise();
  Scene scene = reader.take();
  scene.text = text;
  return scene;
}

std::shared_ptr<const PartValues> parse_part(Kind kind, const std::string& type, const std::string& toml, PartCatalogue& parts) {
  const std::string file = fmt::format("{}/{}", name(kind), type);
  const toml::table table = parse_or_report(toml, file);
  TomlReader reader(parts, file);
  auto values = reader.part(kind, type, table, std::string(name(kind)), "type", {file, 1, 1});
  reader.errors.raise();
  return values;
}

}  // namespace perikit
