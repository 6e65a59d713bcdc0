#include "plugin/manifest.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <random>
#include <toml++/toml.h>

#include "core/fingerprint.hpp"
#include "files/atomic_file.hpp"
#include "files/toml_limits.hpp"
#include "perikit/plugin/abi.hpp"
#include "plugin/registrar.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

constexpr std::int64_t manifest_format = 1;
constexpr std::uintmax_t largest_manifest = 1 << 20;  // [bytes]: far more parts than any library brings

SourcePosition place(const toml::node& node, const fs::path& file) {
  const toml::source_position at = node.source().begin;
  return {file.string(), static_cast<int>(at.line), static_cast<int>(at.column)};
}

/// The value of a key that every manifest has.
template <class T>
T required(const toml::table& table, std::string_view key, const fs::path& file) {
  if (const auto* value = table[key].template as<T>()) return value->get();
  const toml::node& at = table[key] ? *table[key].node() : table;
  throw InputError(place(at, file), key,
                   fmt::format("{}; must be {}", table[key] ? "another type" : "missing",
                               std::is_same_v<T, std::string> ? "a string" : "an integer"));
}

NamedPart read_part(const toml::table& table, const fs::path& file) {
  const auto kind_name = required<std::string>(table, "kind", file);
  const auto kind = kind_from_name(kind_name);
  if (!kind) throw InputError(place(*table.get("kind"), file), "kind", fmt::format("'{}' is no kind of part", kind_name));
  const auto part_name = required<std::string>(table, "name", file);
  if (!is_snake_case(part_name)) {
    throw InputError(place(*table.get("name"), file), "name", fmt::format("'{}'; must be {}", part_name, snake_case_rule));
  }
  return {*kind, part_name, required<std::string>(table, "summary", file)};
}

/// A name beside a file that no other process or thread uses.
fs::path unused_name(const fs::path& file) {
  static std::atomic<unsigned> count{0};
  return fmt::format("{}.{}.{}.{:08x}.new", file.string(), getpid(), count++, std::random_device{}());
}

}  // namespace

bool Manifest::matches_size(const fs::path& library) const {
  std::error_code unreadable;
  return fs::file_size(library, unreadable) == size && !unreadable;
}

bool Manifest::matches(const fs::path& library) const { return matches_size(library) && checksum == fingerprint_of(library).text(); }

fs::path manifest_path(const fs::path& library) { return fs::path(library).replace_extension(".parts"); }

Manifest read_manifest(const fs::path& file) try {
  std::error_code unreadable;
  if (!fs::is_regular_file(file, unreadable)) throw InputError({file.string()}, "", "not a regular file");
  if (fs::file_size(file, unreadable) > largest_manifest || unreadable)
    throw InputError({file.string()}, "", "too large for a manifest");
  const std::string text = read_text(file);
  check_toml_limits(text, file.string(), largest_manifest);
  const toml::table table = toml::parse(std::string_view(text), std::string_view(file.string()));
  if (const auto format = required<std::int64_t>(table, "format", file); format != manifest_format) {
    throw InputError({file.string()}, "format", fmt::format("{}; this program reads {}", format, manifest_format));
  }
  Manifest manifest{.abi = static_cast<int>(required<std::int64_t>(table, "abi", file)),
                    .build_id = required<std::string>(table, "build_id", file),
                    .size = static_cast<std::uintmax_t>(required<std::int64_t>(table, "size", file)),
                    .checksum = required<std::string>(table, "checksum", file),
                    .parts = {}};
  const toml::array* parts = table["part"].as_array();
  if (!parts || parts->empty() || !parts->is_homogeneous<toml::table>()) {
    throw InputError({file.string()}, "part", "must be a list of tables, at least one");
  }
  for (const toml::node& node : *parts) {
    NamedPart part = read_part(*node.as_table(), file);
    const auto same = [&](const NamedPart& other) { return other.kind == part.kind && other.name == part.name; };
    if (std::ranges::any_of(manifest.parts, same)) {
      throw InputError(place(node, file), "part", fmt::format("{} '{}' is named twice", name(part.kind), part.name));
    }
    manifest.parts.push_back(std::move(part));
  }
  return manifest;
} catch (const toml::parse_error& error) {
  const auto& at = error.source().begin;
  throw InputError({file.string(), static_cast<int>(at.line), static_cast<int>(at.column)}, "", error.description());
}

void write_manifest(const fs::path& library, const std::vector<NamedPart>& parts) {
  toml::array list;
  for (const NamedPart& part : parts) {
    list.push_back(toml::table{{"kind", name(part.kind)}, {"name", part.name}, {"summary", part.summary}});
  }
  const toml::table table{{"format", manifest_format},
                          {"abi", PERIKIT_ABI_VERSION},
                          {"build_id", PERIKIT_BUILD_ID},
                          {"size", static_cast<std::int64_t>(fs::file_size(library))},
                          {"checksum", fingerprint_of(library).text()},
                          {"part", std::move(list)}};
  const fs::path file = manifest_path(library);
  const fs::path temporary = unused_name(file);
  std::ofstream out(temporary);
  out << table << '\n';
  out.close();
  std::error_code failed;
  if (out) fs::rename(temporary, file, failed);
  if (!out || failed) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw RunError(fmt::format("{}: cannot be written{}", file.string(), failed ? ": " + failed.message() : ""));
  }
}

}  // namespace perikit
