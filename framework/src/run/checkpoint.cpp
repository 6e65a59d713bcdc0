#include "run/checkpoint.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/fingerprint.hpp"
#include "output/atomic_file.hpp"
#include "output/hdf5_file.hpp"
#include "scene/scene_differences.hpp"

namespace perikit {

namespace fs = std::filesystem;

fs::path checkpoint_file(const fs::path& folder) { return folder / "checkpoint.h5"; }

std::string body_fingerprint(const ReferenceData& body) {
  Fingerprint fingerprint;
  const auto add = [&](const auto& values) { fingerprint.add(std::span(values)); };
  add(body.position);
  add(body.volume);
  add(body.material_id);
  for (const auto& [name, points] : body.sets) {
    add(name);
    add(points);
  }
  return fingerprint.text();
}

void write_checkpoint(const fs::path& folder, const Checkpoint& checkpoint) {
  hdf5::Image image;
  image.attribute("perikit_version", checkpoint.perikit_version);
  image.attribute("scene", checkpoint.scene);
  image.attribute("body", checkpoint.body);
  image.attribute("step", checkpoint.step);
  image.attribute("time", checkpoint.time);
  image.attribute("frames", checkpoint.output.frames);
  image.attribute("history_rows", checkpoint.output.history_rows);
  image.attribute("history_every", checkpoint.output.history_every);
  image.attribute("next_time", checkpoint.output.next_time);
  image.attribute("steps_expected", checkpoint.output.steps_expected);
  image.attribute("end_time", checkpoint.output.end_time);
  image.attribute("initial_energy", checkpoint.output.initial_energy);
  image.dataset("state", checkpoint.state);
  store_atomically(checkpoint_file(folder), image.bytes());
}

Checkpoint read_checkpoint(const fs::path& folder) {
  const hdf5::Source source(checkpoint_file(folder));
  Checkpoint checkpoint;
  checkpoint.perikit_version = source.text("/", "perikit_version");
  checkpoint.scene = source.text("/", "scene");
  checkpoint.body = source.text("/", "body");
  checkpoint.step = source.integer("/", "step");
  checkpoint.time = source.real("/", "time");
  checkpoint.output.frames = source.integer("/", "frames");
  checkpoint.output.history_rows = source.integer("/", "history_rows");
  checkpoint.output.history_every = source.integer("/", "history_every");
  checkpoint.output.next_time = source.integer("/", "next_time");
  checkpoint.output.steps_expected = source.integer("/", "steps_expected");
  checkpoint.output.end_time = source.real("/", "end_time");
  checkpoint.output.initial_energy = source.real("/", "initial_energy");
  checkpoint.state = source.read_bytes("state");
  return checkpoint;
}

void check_same_scene(const std::string& before, const Scene& scene, const fs::path& folder) {
  if (before == scene.resolved) return;
  throw InputError({scene.file.string()}, "",
                   fmt::format("found another scene than the run in {} had, which cannot be continued with it; they differ in\n  {}",
                               folder.string(), fmt::join(scene_differences(before, scene.resolved), "\n  ")));
}

void check_checkpoint(const Checkpoint& checkpoint, const Scene& scene, const std::string& body, const fs::path& folder) {
  const auto refuse = [&](const std::string& message) { throw InputError({checkpoint_file(folder).string()}, "", message); };
  if (checkpoint.perikit_version != PERIKIT_VERSION) {
    refuse(fmt::format("found a checkpoint of perikit {}; this is {}, which need not give the same bits", checkpoint.perikit_version, PERIKIT_VERSION));
  }
  check_same_scene(checkpoint.scene, scene, folder);
  if (checkpoint.body != body) refuse("found the checkpoint of another body: the files that the scene reads have changed");
}

}  // namespace perikit
