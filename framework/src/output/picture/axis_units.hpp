#pragma once
/// What stands at the axes of history pictures: names in words, and units.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace perikit {

/// What the pictures need to know of the scene of a run; of text that is no scene: nothing.
class SceneUnits {
 public:
  /// `scene`: the resolved scene, TOML.
  explicit SceneUnits(const std::string& scene);
  /// "s" where time is one; quasi-static runs have a load parameter there, and the unit is empty.
  const std::string& time() const noexcept { return time_; }
  /// "time"; "load parameter" where load steps lead from 0 to 1.
  const std::string& time_name() const noexcept { return time_name_; }
  /// Unit of a column of history.csv: those that every history has, and the scene's own by their quantities; else empty.
  std::string column(const std::string& name) const;

 private:
  std::string time_, time_name_ = "time";
  std::vector<std::pair<std::string, std::string>> own_;   ///< name, unit
};

/// The resolved scene in the folder of a run; empty where there is none.
std::string scene_text(const std::filesystem::path& folder);

}  // namespace perikit
