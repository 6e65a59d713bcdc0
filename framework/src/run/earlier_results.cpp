#include "run/earlier_results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "output/result_file.hpp"
#include "output/sealed_file.hpp"
#include "run/checkpoint.hpp"
#include "run/output_folder.hpp"
#include "scene/scene_differences.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

class EarlierRun {
 public:
  EarlierRun(const Scene& scene, BodyProblem& problem)
      : scene_(scene),
        problem_(problem),
        folder_(results_folder(*scene.initial_from)),
        frame_(*scene.initial_from, problem.points().size_on_all_ranks()) {}

  std::string carry() {
    std::string taken;
    if (const std::optional<Checkpoint> checkpoint = checkpoint_of_frame()) taken = carry(*checkpoint);
    compare_damage();
    return taken;
  }

 private:
  [[noreturn]] void refuse(const std::string& found, const std::string& allowed) const {
    throw InputError({scene_.file.string()}, "initial.from",
                     fmt::format("found {}, {}; allowed: {}", scene_.initial_from->string(), found, allowed));
  }

  /// The checkpoint of the moment of the last frame.
  std::optional<Checkpoint> checkpoint_of_frame() const {
    try {
      Checkpoint checkpoint = read_checkpoint(folder_);
      if (checkpoint.step == frame_.step() && checkpoint.time == frame_.time()) return checkpoint;
    } catch (const InputError&) {  // none, or a damaged one
    }
    return std::nullopt;
  }

  std::string carry(const Checkpoint& checkpoint) {
    ByteReader state = checkpoint_state(folder_);
    const Carried carried = SavedState::carried_by(state);
    if (carried.bonds == 0 && carried.history == 0) return {};
    const std::string what = carried.bonds > 0 ? fmt::format("results of a run in which {} bonds had failed", carried.bonds)
                                               : "results of a run whose laws have a history";
    if (carried.bonds > 0 && !scene_.damage) refuse(what, "a scene with [damage], without which they would be whole again");
    // Points, bonds and evaluation points must have the numbers that they had.
    std::vector<std::string> others = scene_differences(checkpoint.scene, scene_.resolved);
    const auto of = [](const std::string& difference, std::initializer_list<const char*> sections) {
      return std::ranges::any_of(sections, [&](const char* section) { return difference.starts_with(section); });
    };
    std::erase_if(others, [&](const std::string& difference) {
      return !of(difference, {"body.", "family.", "periodic.", "symmetry."}) &&
             !(carried.history > 0 && of(difference, {"material.", "region.", "kinematics."}));
    });
    if (!others.empty())
      refuse(what + fmt::format(", and of another body or family: {}", fmt::join(others, "; ")), "the same sections as there");
    if (!same_points()) refuse(what + ", and of other points", "the same points");
    try {
      ByteReader again = checkpoint_state(folder_);
      problem_.carry(again);
    } catch (const InputError& error) {
      refuse(fmt::format("{}: {}", what, error.what()), "a scene of the same body and laws");
    }
    std::vector<std::string> taken;
    if (carried.bonds > 0) taken.push_back(fmt::format("{} bonds that had failed or weakened", carried.bonds));
    if (carried.history > 0) taken.emplace_back("the history of the laws");
    return fmt::format("{} from {}", fmt::join(taken, " and "), folder_.string());
  }

  bool same_points() const {
    const Points& points = problem_.points();
    bool same = true;
    hdf5::Source(folder_ / "reference.h5")
        .each_row("position", points.numbers(points.owned()), [&](std::size_t k, std::span<const double> there) {
          const Point x = points.position(static_cast<std::size_t>(points.owned()[k]));
          same = same && std::ranges::equal(x, there);
        });
    return same;
  }

  /// No point may have lost more of its family there than it has here.
  void compare_damage() const {
    if (!frame_.fields().contains("damage")) {
      const auto marked = read_marked(folder_ / "scene.toml");
      if (marked && marked->text.find("\n[damage]") != std::string::npos && !checkpoint_of_frame())
        refuse("results of a run with [damage], whose frames hold no damage, and without a checkpoint of its end",
               "results with a checkpoint: [output] checkpoint_every keeps one at the end");
      return;
    }
    const Field damage = problem_.terms().damage();
    const Points& points = problem_.points();
    frame_.each_row("damage", points.numbers(points.owned()), [&](std::size_t k, std::span<const double> there) {
      const std::int32_t p = points.owned()[k];
      if (there[0] <= damage.data()[p] + 1e-9) return;
      const Point x = points.position(static_cast<std::size_t>(p));
      refuse(fmt::format("results of a run in which bonds were cut or had failed that are whole in this scene, at the point "
                         "({:.6g}, {:.6g}, {:.6g}) for one",
                         x[0], x[1], x[2]),
             "every [[crack]] of that run; where bonds failed, results with a checkpoint of the end: [output] checkpoint_every "
             "keeps one");
    });
  }

  const Scene& scene_;
  BodyProblem& problem_;
  fs::path folder_;
  LastFrame frame_;
};

}  // namespace

std::string carry_from_earlier_run(const Scene& scene, BodyProblem& problem) {
  return scene.initial_from ? EarlierRun(scene, problem).carry() : std::string();
}

}  // namespace perikit
