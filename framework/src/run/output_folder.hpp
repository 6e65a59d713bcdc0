#pragma once
/// The folder that a run or a study writes into: locked for as long as it is used, and nothing in it replaced that perikit did
/// not write.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "files/atomic_file.hpp"

namespace perikit {

class OutputFolder {
 public:
  struct Use {
    const char* marker;                         ///< the file that says whose folder it is: "scene.toml"
    std::vector<std::string> names;             ///< of files and folders that may be written or removed
    std::vector<std::filesystem::path> inputs;  ///< files that are read, and may be none of these
    bool own = false;                           ///< the folder is known to be perikit's own, whatever the marker says
    bool force = false;                         ///< what perikit did not write is replaced all the same
  };

  /// Creates the folder and locks it until the object goes; removes temporary files that a killed run left. Throws InputError
  /// where another process has locked it, an input lies where output goes, or perikit did not write what it would replace.
  OutputFolder(const std::filesystem::path& folder, const Use& use);

  /// Writes the marker: text behind a line that seals it.
  void mark(const std::string& text) const;
  /// False where the file system has no locks.
  bool locked() const noexcept { return locked_; }

 private:
  void refuse_inputs(const Use& use) const;
  void refuse_foreign(const Use& use) const;
  void take_lock();

  std::filesystem::path path_, marker_;
  Descriptor lock_;
  bool locked_ = false;
};

/// The text of a marker without the line of its seal: of an unchanged one, or of any file. Nothing where there is no file.
struct MarkedText {
  std::string text;
  bool sealed = false;
};
std::optional<MarkedText> read_marked(const std::filesystem::path& file);

}  // namespace perikit
