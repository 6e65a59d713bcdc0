#pragma once
#include <filesystem>
#include <map>
#include <string>

namespace perikit::app {

/// Floating-point operations of a point and step by what was stepped, as a program with PERIKIT_COUNT_OPERATIONS counts them. As a file: CSV
/// with the header kinematics,material,dimension,body,cells,operations.
class Operations {
 public:
  /// space: the dimension, "2 stress" and "1 stress" where stresses across the body are zero.
  static std::string key(const std::string& kinematics, const std::string& material, const std::string& space, bool cloud, const std::string& cells);

  Operations() = default;
  /// Throws InputError naming file and line where it cannot be read.
  explicit Operations(const std::filesystem::path& file);

  /// Not a number where they were not counted.
  double of(const std::string& key) const;
  void set(const std::string& key, double operations) { counts_[key] = operations; }
  /// Adds to what the file holds. Throws RunError where it cannot be written.
  void write(const std::filesystem::path& file) const;

 private:
  std::map<std::string, double> counts_;   ///< by the line up to its last comma
};

}  // namespace perikit::app
