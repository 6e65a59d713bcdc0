#pragma once
/// Finds parts by kind and name in shared libraries. Opens a library only when one of its parts is asked for.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "perikit/plugin/part.hpp"

namespace perikit {

/// A file that was refused, and why: "not a shared library (ELF magic missing)", "ABI version 7, this program has 1", ...
struct RefusedLibrary {
  std::filesystem::path file;
  std::string reason;
};

class Registry final : public PartFactory, public PartCatalogue {
 public:
  Registry();
  ~Registry() override;
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// A registry with the standard search path: `first` (from --plugin-path), then PERIKIT_PLUGIN_PATH (colon-separated), then
  /// the plugins of the build or install tree that holds this library.
  static std::vector<std::filesystem::path> standard_search_path(const std::vector<std::filesystem::path>& first);

  /// Adds every *.so below `folder` (not recursive) as a candidate: reads the manifest beside it (X.so -> X.parts) where there is
  /// one, so that names are known without opening; where there is none, a child process opens the library and reports them.
  /// A manifest of a file of another size is stale and ignored; the bytes are compared when the library is opened, and a file
  /// that has changed is tried in a child process first. What is refused is kept in `refused`; a folder
  /// that cannot be read throws InputError. Of two libraries that bring the same part, the second is refused.
  void add_folder(const std::filesystem::path& folder);
  /// Opens and registers one library now; without a manifest of exactly this file, in a child process first, so that a library
  /// that crashes is refused too. Throws InputError with file and reason when it is refused; nothing of it is then known.
  void open(const std::filesystem::path& library) override;

  /// Parts in hand: registered, or named by a manifest. Sorted.
  std::vector<std::string> names(Kind kind) const override;
  /// Opens the library that has it if need be. Throws InputError "found the unknown material 'x'; allowed: ...; did you mean 'y'?" - with
  /// the refused libraries appended when one of them might have held it.
  const PartDescription& describe(Kind kind, std::string_view name) override;
  /// The library that brings this part.
  std::filesystem::path library_of(Kind kind, std::string_view name) const;
  bool known(Kind kind, std::string_view name) const override;

  const std::vector<RefusedLibrary>& refused() const noexcept;
  /// Libraries opened so far, in order.
  std::vector<std::filesystem::path> opened() const;
  /// What one opened library registered.
  std::vector<std::pair<Kind, std::string>> parts_of(const std::filesystem::path& library) const;

  // Parts from their checked values. What a factory throws or leaves null becomes an InputError with part and library.
  std::unique_ptr<Kinematics> kinematics(const PartValues&) const override;
  std::unique_ptr<Stabilization> stabilization(const PartValues&) const override;
  std::unique_ptr<Material> material(const PartValues&) const override;
  std::unique_ptr<Damage> damage(const PartValues&) const override;
  std::unique_ptr<InfluenceFunction> influence(const PartValues&) const override;
  std::unique_ptr<PointTerm> term(const PartValues&) const override;
  std::unique_ptr<Integrator> integrator(const PartValues&) const override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace perikit
