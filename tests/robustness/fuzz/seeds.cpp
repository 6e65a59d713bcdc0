// Writes the seeds of the targets that read HDF5 into the folder named on the command line: hdf5/{points,results}.h5, checkpoint/checkpoint.h5.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "files/atomic_file.hpp"
#include "files/hdf5_file.hpp"
#include "output/recorder.hpp"
#include "run/checkpoint.hpp"

using namespace perikit;
namespace fs = std::filesystem;

namespace {

void write_points(const fs::path& folder) {
  hdf5::Image image;
  for (const char* name : {"x", "y", "z", "volume"}) image.dataset(name, std::vector<double>{1.0, 2.5, 4.0});
  store_atomically(folder / "points.h5", image.bytes());
}

/// A frame in the file itself: in a run's results.h5 it is an external link.
void write_results(const fs::path& folder) {
  hdf5::Image image;
  image.group("/reference");
  image.dataset("/reference/volume", std::vector<double>{1.0, 1.0});
  image.group("/frames");
  image.group("/frames/00000000");
  image.dataset("/frames/00000000/displacement", std::vector<double>(6, 0.5), 3);
  image.attribute("time", 0.5);
  image.attribute("step", std::int64_t{3});
  image.attribute("title", "seed");
  store_atomically(folder / "results.h5", image.bytes());
}

Checkpoint checkpoint() {
  Checkpoint all;
  all.perikit_version = "0.1.0";
  all.scene = "format = 1\n";
  all.body = all.libraries = "0123456789abcdef";
  all.step = 17;
  all.time = 0.25;
  return all;
}

}  // namespace

int main(int count, char** arguments) try {
  if (count != 2) return 2;
  const fs::path folder = arguments[1];
  for (const char* target : {"hdf5", "checkpoint"}) fs::create_directories(folder / target);
  write_points(folder / "hdf5");
  write_results(folder / "hdf5");
  std::vector<std::byte> state;
  for (int k = 0; k < 4096; ++k) state.push_back(static_cast<std::byte>(k * 7));
  NewCheckpoint kept(folder / "checkpoint", checkpoint(), state.size());
  kept.add(state);
  kept.keep();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
