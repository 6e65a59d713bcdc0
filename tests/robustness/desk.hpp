#pragma once
/// A folder with a scene, the program run in it, and what it leaves there.

#include <doctest/doctest.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/kit/messages.hpp"
#include "unit/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace perikit::test {

inline constexpr std::size_t points = 8 * 5;

/// Address and thread sanitizer map terabytes of their own: no limit of the address space can be set.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool unlimited_addresses = true;
#else
inline constexpr bool unlimited_addresses = false;
#endif

/// A plate that is pulled for 1 s in steps of 0.02 s.
inline const std::string plate = R"(format = 1
title = "Pulled plate"

[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = 1.0
lower = [0, 0]
upper = [8, 5]

[sets]
left = "x < 2"
right = "x > 6"

[family]
horizon_ratio = 2.015

[kinematics]
type = "baqp"

[material]
type = "neo_hookean"
density = 1.0
shear_modulus = 0.8
bulk_modulus = 2.0

[[boundary]]
set = "left"
displacement = [0, 0]
[[boundary]]
set = "right"
velocity = [0.1, "free"]

[integrator]
type = "verlet"
time_step = 0.02
end_time = 1.0

[output]
frames = 5
history_every = 1
history = [ { name = "pull", set = "right", quantity = "reaction", component = "x", reduce = "sum" } ]
)";

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

inline std::string read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Result {
  int status;
  std::string out, err;
};

/// A folder with a scene, and the program run in it.
class Desk {
 public:
  explicit Desk(const std::string& scene = plate) { write("scene.toml", scene); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }
  fs::path path(const std::string& name) const { return folder_.path / name; }
  std::string text(const std::string& name) const { return read(path(name)); }

  /// `before`: shell commands, e.g. limits.
  Result perikit(const std::string& arguments, const std::string& before = {}) const {
    const std::string command = fmt::format("cd '{}' && {} '{}' {} > stdout.txt 2> stderr.txt", folder_.path.string(), before, PERIKIT_PROGRAM, arguments);
    const int status = std::system(command.c_str());
    REQUIRE(WIFEXITED(status));
    return {WEXITSTATUS(status), text("stdout.txt"), text("stderr.txt")};
  }

  /// Starts the program and returns its process.
  pid_t start(const std::vector<std::string>& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    std::vector<char*> words{const_cast<char*>(PERIKIT_PROGRAM)};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    if (chdir(folder_.path.c_str()) == 0) execv(PERIKIT_PROGRAM, words.data());
    _exit(127);
  }

 private:
  TemporaryFolder folder_;
};

/// Time, step and `displacement` of one frame file; -1 values where it cannot be read.
struct Frame {
  double time = NAN;
  std::int64_t step = -1;
  hssize_t values = -1;
  std::vector<double> displacement{};
  bool operator==(const Frame&) const = default;
};

inline Frame read_frame(const fs::path& file, const std::string& group = "/") {
  Frame frame;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t handle = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (handle < 0) return frame;
  const auto attribute = [&](const char* name, hid_t type, void* to) {
    const hid_t a = H5Aopen_by_name(handle, group.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
    if (a < 0) return;
    H5Aread(a, type, to);
    H5Aclose(a);
  };
  attribute("time", H5T_NATIVE_DOUBLE, &frame.time);
  attribute("step", H5T_NATIVE_INT64, &frame.step);
  if (const hid_t set = H5Dopen2(handle, (group + "/displacement").c_str(), H5P_DEFAULT); set >= 0) {
    const hid_t space = H5Dget_space(set);
    const hssize_t values = H5Sget_simple_extent_npoints(space);
    frame.displacement.resize(static_cast<std::size_t>(values));
    if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, frame.displacement.data()) >= 0) frame.values = values;
    H5Sclose(space);
    H5Dclose(set);
  }
  H5Fclose(handle);
  return frame;
}

inline std::vector<Frame> read_frames(const fs::path& folder) {
  std::vector<Frame> frames;
  for (std::size_t k = 0; fs::exists(folder / fmt::format("frames/{:08}.h5", k)); ++k) frames.push_back(read_frame(folder / fmt::format("frames/{:08}.h5", k)));
  return frames;
}

inline std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

}  // namespace perikit::test
