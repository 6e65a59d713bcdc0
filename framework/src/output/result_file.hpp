#pragma once
/// The results of a run, opened for reading through results.h5.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "files/hdf5_file.hpp"

namespace perikit {

/// Eight digits of a frame's index, as in frames/00000003.h5 and /frames/00000003.
std::string frame_name(std::int64_t index);

/// The index that a name of eight digits stands for; -1 for any other name.
std::int64_t frame_index(const std::string& name);

/// The folder of a run, whether `results` names the folder or its results.h5.
std::filesystem::path results_folder(const std::filesystem::path& results);

class ResultFile {
 public:
  /// `results`: results.h5 or its folder. Throws InputError where it cannot be read.
  explicit ResultFile(const std::filesystem::path& results);

  const std::filesystem::path& path() const noexcept { return path_; }
  /// Indices of the frames, ascending.
  const std::vector<std::int64_t>& frames() const noexcept { return frames_; }
  /// Path of the group of a frame. Throws InputError naming the frames that are there.
  std::string frame_group(std::int64_t index) const;
  const hdf5::Source& source() const noexcept { return source_; }
  /// use(k, position, volume) of the point numbers[k] of the body of the run, for ascending numbers. Throws InputError where the results
  /// have lost them.
  void each_point(std::span<const std::int64_t> numbers,
                  const std::function<void(std::size_t k, std::span<const double> position, double volume)>& use) const;

 private:
  std::filesystem::path path_;
  hdf5::Source source_;
  std::vector<std::int64_t> frames_;
};

}  // namespace perikit
