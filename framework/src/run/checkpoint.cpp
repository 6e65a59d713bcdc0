#include "run/checkpoint.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "core/fingerprint.hpp"
#include "files/atomic_file.hpp"
#include "files/hdf5_file.hpp"
#include "output/sealed_file.hpp"
#include "perikit/core/rank_values.hpp"
#include "scene/scene_differences.hpp"

namespace perikit {

namespace fs = std::filesystem;

fs::path checkpoint_file(const fs::path& folder) { return folder / "checkpoint.h5"; }

std::string body_fingerprint(const ReferenceData& body) {
  Fingerprint fingerprint;
  const auto add = [&](const auto& values) { fingerprint.add(std::as_bytes(std::span(values))); };
  for (std::size_t p = 0; p < body.points; ++p) {
    const ReferenceData::Point point = body.point(p);
    add(point.position);
    add(std::array{point.volume});
    add(std::array{point.material_id});
  }
  for (const auto& [name, set] : body.sets) {
    add(name);
    set.each(add);
  }
  return fingerprint.text();
}

namespace {

/// File names of libraries that only one of the two lists holds as they are.
std::set<std::string> other_libraries(const std::string& before, const std::string& now) {
  const auto lines = [](const std::string& text) {
    std::istringstream stream(text);
    std::set<std::string> all;
    for (std::string line; std::getline(stream, line);) all.insert(line);
    return all;
  };
  const std::set<std::string> a = lines(before), b = lines(now);
  std::vector<std::string> differing;
  std::ranges::set_symmetric_difference(a, b, std::back_inserter(differing));
  std::set<std::string> names;
  for (const std::string& line : differing) names.insert(line.substr(0, line.rfind(' ')));
  return names;
}

}  // namespace

std::string library_fingerprints(const Registry& registry) {
  std::set<std::string> lines;
  for (const fs::path& library : registry.opened()) {
    lines.insert(fmt::format("{} {}", library.filename().string(), fingerprint_of(library).text()));
  }
  return fmt::format("{}", fmt::join(lines, "\n"));
}

struct NewCheckpoint::File {
  explicit File(const fs::path& folder) : file(checkpoint_file(folder)) {}
  hdf5::StoredFile file;
  std::optional<hdf5::NewFile::Rows> state;
};

NewCheckpoint::NewCheckpoint(const fs::path& folder, const Checkpoint& checkpoint, std::uint64_t state_size)
    : file_(std::make_unique<File>(folder)) {
  hdf5::StoredFile& file = file_->file;
  file.attribute("perikit_version", checkpoint.perikit_version);
  file.attribute("scene", checkpoint.scene);
  file.attribute("body", checkpoint.body);
  file.attribute("libraries", checkpoint.libraries);
  file.attribute("step", checkpoint.step);
  file.attribute("time", checkpoint.time);
  file.attribute("frames", checkpoint.output.frames);
  file.attribute("history_rows", checkpoint.output.history_rows);
  file.attribute("history_every", checkpoint.output.history_every);
  file.attribute("next_time", checkpoint.output.next_time);
  file.attribute("steps_expected", checkpoint.output.steps_expected);
  file.attribute("end_time", checkpoint.output.end_time);
  file.attribute("initial_energy", checkpoint.output.energies.initial);
  file.attribute("largest_energy", checkpoint.output.energies.largest);
  file.attribute("energy_imbalance", checkpoint.output.energies.off);
  file.attribute("frame_spacing", checkpoint.output.frame_spacing);
  file.attribute("history_fingerprint", checkpoint.output.history_fingerprint);
  file.dataset("frame_fingerprints", std::as_bytes(std::span(checkpoint.output.frame_fingerprints)));
  file_->state.emplace(file.rows("state", state_size, 1, hdf5::NewFile::Numbers::bytes));
}

NewCheckpoint::~NewCheckpoint() = default;

void NewCheckpoint::add(std::span<const std::byte> state) {
  file_->state->append(state);
  file_->file.check();
}

void NewCheckpoint::keep() {
  file_->state.reset();
  file_->file.keep(seal);
}

Checkpoint read_checkpoint(const fs::path& folder) {
  if (!seal_holds(checkpoint_file(folder))) {
    throw InputError({checkpoint_file(folder).string()}, "",
                     "found other bytes than were written; allowed: an undamaged checkpoint, or a run without --resume");
  }
  const hdf5::Source source(checkpoint_file(folder));
  Checkpoint checkpoint;
  checkpoint.perikit_version = source.text("/", "perikit_version");
  checkpoint.scene = source.text("/", "scene");
  checkpoint.body = source.text("/", "body");
  checkpoint.libraries = source.text("/", "libraries");
  checkpoint.step = source.integer("/", "step");
  checkpoint.time = source.real("/", "time");
  checkpoint.output.frames = source.integer("/", "frames");
  checkpoint.output.history_rows = source.integer("/", "history_rows");
  checkpoint.output.history_every = source.integer("/", "history_every");
  checkpoint.output.next_time = source.integer("/", "next_time");
  checkpoint.output.steps_expected = source.integer("/", "steps_expected");
  checkpoint.output.end_time = source.real("/", "end_time");
  checkpoint.output.energies = {source.real("/", "initial_energy"), source.real("/", "largest_energy"),
                                source.real("/", "energy_imbalance")};
  checkpoint.output.frame_spacing = source.real("/", "frame_spacing");
  checkpoint.output.history_fingerprint = source.integer("/", "history_fingerprint");
  const std::vector<std::byte> frames = source.read_bytes("frame_fingerprints");
  checkpoint.output.frame_fingerprints.resize(frames.size() / sizeof(std::int64_t));
  std::memcpy(checkpoint.output.frame_fingerprints.data(), frames.data(),
              checkpoint.output.frame_fingerprints.size() * sizeof(std::int64_t));
  return checkpoint;
}

ByteReader checkpoint_state(const fs::path& folder, bool shared) {
  const bool reads = !shared || communicator().rank() == 0, tells = shared && communicator().size() > 1;
  std::shared_ptr<const hdf5::Source> source;
  std::vector<std::uint64_t> size(1);
  if (reads) {
    source = std::make_shared<hdf5::Source>(checkpoint_file(folder));
    size[0] = source->shape("state")[0];
  }
  if (tells) size = told_to_all(size);
  return {size[0], [source, tells, size = size[0], at = std::uint64_t{0}]() mutable {
            constexpr std::uint64_t most = std::uint64_t{1} << 20;
            const std::uint64_t count = std::min(most, size - at);
            std::vector<std::byte> piece;
            if (source) piece = source->read_bytes("state", at, count);
            if (tells) communicator().broadcast(piece);
            at += count;
            return piece;
          }};
}

bool check_same_scene(const std::string& before, const Scene& scene, const fs::path& folder, bool may_lengthen) {
  if (before == scene.resolved) return false;
  const std::vector<std::string> differences = scene_differences(before, scene.resolved);
  const auto of_length = [](const std::string& difference) { return difference.starts_with("integrator.end_time: ") || difference.starts_with("integrator.steps: "); };
  if (may_lengthen && std::ranges::all_of(differences, of_length)) return true;
  throw InputError({scene.file.string()}, "",
                   fmt::format("found another scene than the run in {} had, which cannot be continued with it{}; they differ in\n  {}", folder.string(),
                               may_lengthen ? "; allowed: another integrator.end_time or integrator.steps, and nothing else" : "", fmt::join(differences, "\n  ")));
}

bool check_checkpoint(const Checkpoint& checkpoint, const Scene& scene, const std::string& body, const std::string& libraries,
                      const fs::path& folder) {
  const auto refuse = [&](const std::string& message) { throw InputError({checkpoint_file(folder).string()}, "", message); };
  if (checkpoint.perikit_version != PERIKIT_VERSION) {
    refuse(fmt::format("found a checkpoint of perikit {}; this is {}, which need not give the same bits", checkpoint.perikit_version, PERIKIT_VERSION));
  }
  const bool lengthened = check_same_scene(checkpoint.scene, scene, folder, true);
  if (checkpoint.body != body) refuse("found the checkpoint of another body: the files that the scene reads have changed");
  // Runs of a study keep no list.
  const auto others = other_libraries(checkpoint.libraries, libraries);
  if (!checkpoint.libraries.empty() && !others.empty()) {
    refuse(fmt::format(
        "found libraries that are not those that the run began with: {}; allowed: the same files, or a run without --resume",
        fmt::join(others, ", ")));
  }
  return lengthened;
}

}  // namespace perikit
