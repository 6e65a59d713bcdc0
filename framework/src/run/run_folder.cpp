#include "run/run_folder.hpp"

#include <fmt/format.h>

#include "output/sealed_file.hpp"
#include "perikit/core/warnings.hpp"
#include "run/checkpoint.hpp"

namespace perikit {

namespace {

/// Whether a checkpoint of perikit's lies there: the folder of a run whose scene.toml is gone.
bool holds_checkpoint(const std::filesystem::path& folder) {
  try {
    return seal_holds(checkpoint_file(folder));
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

bool ended(const OutputProgress& run, std::int64_t step, double time) {
  return (run.steps_expected > 0 && step >= run.steps_expected) || (run.end_time > 0 && time >= run.end_time * (1 - 1e-12));
}

std::string earlier_run(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "scene.toml")) return {};
  if (std::filesystem::exists(checkpoint_file(folder))) {
    try {
      const Checkpoint checkpoint = read_checkpoint(folder);
      if (!ended(checkpoint.output, checkpoint.step, checkpoint.time)) {
        return named("replaced_run", fmt::format(
            "warning: replaces a run in {} that was stopped and kept a checkpoint at step {}, time {:.6g} s: --resume would have "
            "gone on with it",
            folder.string(), checkpoint.step, checkpoint.time));
      }
    } catch (const InputError&) {  // nothing that could be gone on with
    }
  }
  return fmt::format("replaces the results of an earlier run in {}", folder.string());
}

OutputFolder::Use use_of_folder(const Scene& scene, const std::filesystem::path& folder, bool force) {
  OutputFolder::Use use{
      .marker = "scene.toml",
      .names = {"scene.toml", "results.h5", "reference.h5", "results.xdmf", "history.csv", "run.log", "checkpoint.h5", "frames"},
      .inputs = {},
      .own = holds_checkpoint(folder),
      .force = force};
  if (scene.body.points_file) use.inputs.push_back(*scene.body.points_file);
  if (scene.initial_from) {
    const bool is_folder = std::filesystem::is_directory(*scene.initial_from);
    use.inputs.push_back(is_folder ? *scene.initial_from / "results.h5" : *scene.initial_from);
  }
  // A scene that a run left there runs again into its own folder, unless overrides change it.
  std::error_code missing;
  if (std::filesystem::equivalent(scene.file, folder / "scene.toml", missing)) {
    const auto there = read_marked(scene.file);
    if (!there || !there->sealed || there->text != scene.resolved) use.inputs.push_back(scene.file);
  } else {
    use.inputs.push_back(scene.file);
  }
  return use;
}

}  // namespace perikit
