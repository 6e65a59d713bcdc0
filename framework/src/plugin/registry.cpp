#include "plugin/registry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/dll/runtime_symbol_info.hpp>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "model/kinematics_class.hpp"
#include "perikit/damage.hpp"
#include "perikit/influence.hpp"
#include "perikit/integrator.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/material.hpp"
#include "perikit/plugin/abi.hpp"
#include "perikit/stabilization.hpp"
#include "perikit/term.hpp"
#include "plugin/library.hpp"
#include "plugin/manifest.hpp"
#include "plugin/registrar.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

/// The one name of a file, so that a library reached by two ways is one library.
fs::path canonical_path(const fs::path& file) {
  std::error_code failed;
  const fs::path path = fs::weakly_canonical(file, failed);
  return failed ? fs::absolute(file) : path;
}

}  // namespace

struct Registry::Implementation {
  struct Entry {
    fs::path library;
    std::shared_ptr<const RegisteredPart> part;  ///< null: named by a manifest, the library is not open yet
  };
  using Entries = std::map<std::string, Entry, std::less<>>;

  std::array<Entries, all_kinds.size()> entries;
  std::set<fs::path> candidates;
  std::map<fs::path, Manifest> manifests;  ///< of libraries that are not open yet
  std::vector<fs::path> opened;
  std::vector<RefusedLibrary> refused;

  Entries& of(Kind kind) { return entries[static_cast<std::size_t>(kind)]; }
  const Entries& of(Kind kind) const { return entries[static_cast<std::size_t>(kind)]; }

  fs::path owner(Kind kind, std::string_view name) const {
    const auto entry = of(kind).find(name);
    return entry == of(kind).end() ? fs::path() : entry->second.library;
  }

  std::vector<std::string> names(Kind kind) const {
    std::vector<std::string> names;
    for (const auto& [name, entry] : of(kind)) names.push_back(name);
    return names;
  }

  void forget(const fs::path& library) {
    for (Entries& kind : entries) std::erase_if(kind, [&](const auto& e) { return e.second.library == library; });
  }

  /// Forgets what a manifest named, and keeps the reason.
  void refuse(const fs::path& file, const std::string& reason) {
    forget(file);
    std::erase_if(refused, [&](const RefusedLibrary& r) { return r.file == file; });
    refused.push_back({file, reason});
  }

  /// Reads the manifest of a library, if there is one. A stale one says nothing; an unreadable one is refused by name.
  /// The library itself is not read: its size must do until it is opened, or a scan would read every plugin there is. Only to be
  /// refused for its ABI it must be the very file.
  const Manifest* manifest_of(const fs::path& library) {
    const fs::path file = manifest_path(library);
    // Not exists(): a link to nowhere or to itself is a bad manifest, not a missing one.
    std::error_code failed;
    if (fs::symlink_status(file, failed).type() == fs::file_type::not_found) return nullptr;
    try {
      Manifest manifest = read_manifest(file);
      const bool fits = manifest.abi == PERIKIT_ABI_VERSION && manifest.build_id == PERIKIT_BUILD_ID;
      if (fits ? manifest.matches_size(library) : manifest.matches(library)) return &manifests.insert_or_assign(library, std::move(manifest)).first->second;
    } catch (const InputError& error) {
      refuse(file, fmt::format("bad manifest: {}", error.what()));
    }
    return nullptr;
  }

  void name_parts(const fs::path& library, const std::vector<NamedPart>& parts) {
    for (const NamedPart& part : parts) {
      if (const fs::path first = owner(part.kind, part.name); !first.empty()) {
        throw Refusal(fmt::format("{} '{}': duplicate: {} already brings it", name(part.kind), part.name, first.string()));
      }
    }
    for (const NamedPart& part : parts) of(part.kind)[part.name] = {library, nullptr};
  }

  void load(const fs::path& library) {
    // A file that its manifest describes byte for byte was opened before, when the manifest was written. One of the same size whose
    // bytes are others is damaged: it might load, and compute something else. Any other is tried in a child process first, and
    // what an old manifest named is forgotten.
    const auto manifest = manifests.find(library);
    if (manifest == manifests.end() || !manifest->second.matches(library)) {
      if (manifest != manifests.end() && manifest->second.matches_size(library))
        throw Refusal(fmt::format("its bytes are not those that {} describes: damaged, or built anew without its manifest, which "
                                  "perikit-manifest writes again",
                                  manifest_path(library).filename().string()));
      forget(library);
      probe_library(library);
      suspect_in_crashes(library);
    }
    PartCollector collector([&](Kind kind, std::string_view name) {
      const fs::path first = owner(kind, name);
      return first == library ? fs::path() : first;
    });
    load_library(library, collector);
    if (collector.parts.empty()) throw Refusal("it registers no part");
    for (const auto& part : collector.parts) of(part->kind())[part->description.name] = {library, part};
    for (const Entries& kind : entries) {
      for (const auto& [name, entry] : kind) {
        if (entry.library == library && !entry.part)
          throw Refusal(fmt::format("its manifest names '{}', which it does not register", name));
      }
    }
  }

  void open(const fs::path& library) {
    if (std::ranges::find(opened, library) != opened.end()) return;
    try {
      load(library);
    } catch (const Refusal& reason) {
      refuse(library, reason.what());
      throw InputError({library.string()}, "", fmt::format("this library is refused: {}", reason.what()));
    }
    std::erase_if(refused, [&](const RefusedLibrary& r) { return r.file == library; });
    opened.push_back(library);
  }

  /// What a folder holds is taken where it is good; what is refused is only kept in `refused`. Nothing is opened here, or a damaged
  /// library that nobody asks for could bring the program down: one without a manifest is asked in a child process what it brings.
  void add_candidate(const fs::path& library) {
    if (!candidates.insert(library).second) return;
    try {
      if (const Manifest* manifest = manifest_of(library)) {
        check_file(library);
        check_abi(manifest->abi, manifest->build_id);
        name_parts(library, manifest->parts);
      } else {
        name_parts(library, probe_library(library));
      }
    } catch (const Refusal& reason) {
      refuse(library, reason.what());
    }
  }

  [[noreturn]] void unknown(Kind kind, std::string_view part) const {
    const auto known = names(kind);
    std::string message = fmt::format("found the unknown {} '{}'; allowed: {}{}", name(kind), part,
                                      known.empty() ? "none, no library brings any" : fmt::format("{}", fmt::join(known, ", ")),
                                      did_you_mean(part, known));
    const char* separator = "; refused libraries, one of which may hold it: ";
    // After an update all libraries of a folder may have the same reason: many of one are named by the first.
    constexpr std::ptrdiff_t many = 4;
    for (auto r = refused.begin(); r != refused.end(); ++r) {
      const auto like_it = [&](const RefusedLibrary& other) { return other.reason == r->reason; };
      const auto alike = std::count_if(refused.begin(), refused.end(), like_it);
      if (alike >= many && std::any_of(refused.begin(), r, like_it)) continue;
      message += fmt::format("{}{}{} ({})", separator, r->file.string(), alike >= many ? fmt::format(" and {} others", alike - 1) : "", r->reason);
      separator = "; ";
    }
    if (refused.empty() && did_you_mean(part, known).empty()) message += "; parts in other folders: --plugin-path, PERIKIT_PLUGIN_PATH";
    throw InputError(message);
  }

  const RegisteredPart& part(Kind kind, std::string_view part) {
    auto entry = of(kind).find(part);
    if (entry != of(kind).end() && !entry->second.part) {
      open(fs::path(entry->second.library));
      entry = of(kind).find(part);  // gone where the file has changed and no longer brings it
    }
    if (entry == of(kind).end()) unknown(kind, part);
    return *entry->second.part;
  }

  InputError not_made(Kind kind, const PartValues& values, std::string_view reason) const {
    return InputError(
        values.values.position(""), values.values.path(),
        fmt::format("{} '{}' of {} cannot be made: {}", name(kind), values.type, owner(kind, values.type).string(), reason));
  }

  template <class Interface>
  std::unique_ptr<Interface> create(Kind kind, const PartValues& values, const PartFactory& parts) {
    const RegisteredPart& chosen = part(kind, values.type);
    try {
      if (auto product = std::get<Factory<Interface>>(chosen.factory)(values.values, parts)) return product;
    } catch (const InputError&) {
      throw;  // it names its place already
    } catch (const std::exception& error) {
      throw not_made(kind, values, error.what());
    } catch (...) {
      throw not_made(kind, values, "its factory threw something that is no std::exception");
    }
    throw not_made(kind, values, "its factory returned nothing");
  }
};

Registry::Registry() : implementation_(std::make_unique<Implementation>()) {}
Registry::~Registry() = default;

std::vector<fs::path> Registry::standard_search_path(const std::vector<fs::path>& first) {
  std::vector<fs::path> folders = first;
  if (const char* variable = std::getenv("PERIKIT_PLUGIN_PATH")) {
    std::istringstream list(variable);
    for (std::string folder; std::getline(list, folder, ':');) {
      if (!folder.empty()) folders.emplace_back(folder);
    }
  }
  static const char here = 0;
  const fs::path own = canonical_path(boost::dll::symbol_location_ptr(&here)).parent_path() / "perikit";
  if (std::error_code failed; fs::is_directory(own, failed)) folders.push_back(own);
  return folders;
}

void Registry::add_folder(const fs::path& folder) {
  std::error_code failed;
  std::vector<fs::path> libraries;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->path().extension() == ".so") libraries.push_back(canonical_path(entry->path()));
  }
  if (failed) throw InputError({folder.string()}, "", fmt::format("this plugin folder cannot be read: {}", failed.message()));
  std::ranges::sort(libraries);
  for (const fs::path& library : libraries) implementation_->add_candidate(library);
}

void Registry::open(const fs::path& library) {
  const fs::path file = canonical_path(library);
  implementation_->candidates.insert(file);
  implementation_->manifest_of(file);
  implementation_->open(file);
}

std::vector<std::string> Registry::names(Kind kind) const {
  return implementation_->names(kind);
}
const PartDescription& Registry::describe(Kind kind, std::string_view name) {
  return implementation_->part(kind, name).description;
}
bool Registry::known(Kind kind, std::string_view name) const {
  return !implementation_->owner(kind, name).empty();
}
const std::vector<RefusedLibrary>& Registry::refused() const noexcept {
  return implementation_->refused;
}
std::vector<fs::path> Registry::opened() const {
  return implementation_->opened;
}

fs::path Registry::library_of(Kind kind, std::string_view name) const {
  fs::path library = implementation_->owner(kind, name);
  if (library.empty()) implementation_->unknown(kind, name);
  return library;
}

std::vector<std::pair<Kind, std::string>> Registry::parts_of(const fs::path& library) const {
  std::vector<std::pair<Kind, std::string>> parts;
  for (const Kind kind : all_kinds) {
    for (const auto& [name, entry] : implementation_->of(kind)) {
      if (entry.part && entry.library == canonical_path(library)) parts.emplace_back(kind, name);
    }
  }
  return parts;
}

std::unique_ptr<Kinematics> Registry::kinematics(const PartValues& values) const {
  std::unique_ptr<Kinematics> made = implementation_->create<Kinematics>(Kind::kinematics, values, *this);
  try {
    kinematics_class(*made);
  } catch (const std::invalid_argument& error) {
    throw implementation_->not_made(Kind::kinematics, values, error.what());
  }
  return made;
}
std::unique_ptr<Stabilization> Registry::stabilization(const PartValues& values) const {
  return implementation_->create<Stabilization>(Kind::stabilization, values, *this);
}
std::unique_ptr<Material> Registry::material(const PartValues& values) const {
  return implementation_->create<Material>(Kind::material, values, *this);
}
std::unique_ptr<Damage> Registry::damage(const PartValues& values) const {
  return implementation_->create<Damage>(Kind::damage, values, *this);
}
std::unique_ptr<InfluenceFunction> Registry::influence(const PartValues& values) const {
  return implementation_->create<InfluenceFunction>(Kind::influence, values, *this);
}
std::unique_ptr<PointTerm> Registry::term(const PartValues& values) const { return implementation_->create<PointTerm>(Kind::term, values, *this); }
std::unique_ptr<Integrator> Registry::integrator(const PartValues& values) const {
  return implementation_->create<Integrator>(Kind::integrator, values, *this);
}

}  // namespace perikit
