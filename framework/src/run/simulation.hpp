#pragma once
/// A scene made ready to run, and the observer that records a run into a folder.

#include <chrono>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/threads/work_steps.hpp"
#include "output/recorder.hpp"
#include "output_fields/point_fields.hpp"
#include "perikit/problem/integrator.hpp"
#include "plugin/registry.hpp"
#include "problem/body_problem.hpp"
#include "scene/scene.hpp"

namespace perikit {

class SmallStrains;

class Simulation {
 public:
  /// Builds body, model and integrator. Throws InputError for what only building can show (empty sets, missing densities).
  /// show: told of each step of the work as it begins.
  Simulation(const Scene& scene, const PartFactory& factory, WorkSteps::Show show = {});
  ~Simulation();

  const Scene& scene() const noexcept { return scene_; }
  /// What the integrator takes beyond the problem [bytes]; RunError where the machine has less.
  double refuse_memory();
  /// What the set-up took.
  WorkSteps& set_up() noexcept { return set_up_; }
  BodyProblem& problem() noexcept { return *problem_; }
  Integrator& integrator() noexcept { return *integrator_; }
  /// Watches strains and rotations where parts of the scene are for small ones only.
  SmallStrains& small_strains() noexcept { return *small_strains_; }
  /// Warnings about parts tell the limits that these state of themselves, which the catalogue knows.
  void tell_limits(PartCatalogue& parts);
  bool dynamic() const noexcept { return traits_.dynamic; }
  bool quasi_static() const noexcept { return traits_.quasi_static; }
  /// Runs to the end. Throws RunError.
  void run(Observer& observer);
  /// Points, bonds, memory and the integrator's plan, one per line - what `perikit check` prints.
  std::string summary();
  /// The body, its sets, materials, boundaries and loads, and what was decided where the scene is silent, one per line. Of one rank.
  std::string overview();
  /// What was left out, why, and what it saves - what `--explain` prints.
  std::string explanation(const Registry& registry) const;

 private:
  /// InputError where output asks a pair law for fields that it does not have.
  void refuse_shapes() const;
  /// InputError where a load, a boundary or the exact values of a history column have no finite value at the start or the end.
  void evaluate_conditions();
  /// InputError where nothing holds a piece of a body whose equilibrium is looked for.
  void watch_pieces();
  /// What the integrator intends, a line.
  std::string plan();

  WorkSteps set_up_;
  Scene scene_;
  std::unique_ptr<Integrator> integrator_;
  IntegratorTraits traits_;
  std::unique_ptr<BodyProblem> problem_;
  std::unique_ptr<SmallStrains> small_strains_;
  std::string carried_, loose_;   ///< from an earlier run, by weak springs; in words
};

/// The columns of history.csv: the standard ones, the part of the dissipated energy that laws dissipate where some do, then those that
/// the scene asks for.
std::vector<std::string> history_columns(const Scene& scene, bool laws_dissipate);

/// The libraries that a registry has opened, a line "file name, fingerprint of the bytes" for each.
std::string library_fingerprints(const Registry& registry);

/// What went by before a run began its steps.
struct TimesBefore {
  std::chrono::steady_clock::time_point begin;   ///< of the program's work
  double set_up = 0, plan = 0;                   ///< [s]; plan: until it was known which steps the run would make
};

enum class RunStart {
  fresh,   ///< from the initial state; what an earlier run left in the folder is replaced
  resume,  ///< from checkpoint.h5 in the folder; from the initial state where there is none
};

/// What the energies of a run lack of adding up: strain + kinetic + dissipated = initial + work of boundaries and loads.
struct EnergyBalance {
  double initial = 0;  ///< strain + kinetic [J] at step 0
  double largest = 0;  ///< the largest of all the energies that were seen [J]
  double off = 0;      ///< the largest imbalance that was seen [J]

  /// The imbalance of `energies` [J], which becomes part of the record. kick: what the loads of this moment leave of it in explicit runs,
  /// energy_of_load_kick; it is taken off.
  double add(const Energies& energies, double kick) noexcept;
  /// off over largest; 0 where there was no energy.
  double share() const noexcept { return largest > 0 ? off / largest : 0.0; }
};

/// Of an explicit run: the kinetic energy that half a step of the present loads alone gives to a body at rest [J].
double energy_of_load_kick(BodyProblem& problem, double time_step);

/// Where the output of a run stands: what a checkpoint holds besides the state.
struct OutputProgress {
  std::int64_t frames = 0, history_rows = 0;   ///< those that the scene asks for; not the ones of a stop
  std::int64_t next_time = 0;                  ///< of [output] times
  std::int64_t history_every = 0;              ///< 0: not known before the first step
  std::int64_t steps_expected = 0;
  double end_time = 0;
  double frame_spacing = 0;                    ///< of [output] frames: it stays where a run is lengthened
  EnergyBalance energies;
  std::vector<std::int64_t> frame_fingerprints;   ///< of the files of these frames, up to the last checkpoint
  std::int64_t history_fingerprint = 0;        ///< of the values in these rows; 0: none yet
};

class OutputFolder;
class SharedFile;

/// Writes frames, history, checkpoints and log of a run, and shows progress.
class RunRecorder final : public Observer {
 public:
  /// show_progress: a live line on a terminal, a line now and then elsewhere. A resumed run puts the state of the checkpoint into
  /// the problem and cuts frames and history back to it. Throws InputError where the folder holds the run of another scene or
  /// body, or of other libraries (`libraries`: library_fingerprints; empty where nothing resumes), another
  /// process writes into it, or (unless `force`) perikit did not write what would be replaced.
  RunRecorder(Simulation& simulation, std::filesystem::path folder, bool show_progress, RunStart start = RunStart::fresh,
              std::string libraries = {}, bool force = false);
  ~RunRecorder() override;

  bool wants_sample(std::int64_t step, double time) override;
  void step_done(const StepReport& report) override;
  /// Lines that begin with "warning" are told again at the end.
  void log(std::string_view message) override;
  bool cancelled() const noexcept override;
  void working(std::string_view what) override;
  bool interrupted() const noexcept override;
  void stopped_within_step() override;

  /// The end of the run: waits until all is on the disk. RunError where something did not come there.
  void finish();
  /// Written by this rank: by rank 0.
  std::int64_t frames() const noexcept { return writer_ ? writer_->frames() : 0; }
  const std::vector<std::string>& history_columns() const noexcept { return columns_; }
  /// What a user wants to know at the end: time by phase, speed, memory, energy balance, warnings.
  std::string closing(const TimesBefore& before) const;
  /// What rank 0 takes beyond its part to write what other ranks have: 60 bytes a point (measured) of the pieces in which that comes.
  static double bytes_of_pieces(std::size_t points_of_all_ranks) noexcept;
  /// The step of the checkpoint that the run goes on from; -1: from the initial state.
  std::int64_t resumed_step() const noexcept { return resumed_step_; }

 private:
  void start_fresh(RunStart start);
  void start_from_checkpoint();
  /// InputError where a run that is lengthened cannot be.
  void check_longer() const;
  std::filesystem::path frame_file(std::int64_t index) const;
  /// InputError naming the file where frames or history are not those that the run wrote.
  void check_kept_files() const;
  bool checkpoint_due(std::int64_t step, double time) const;
  void keep_checkpoint(const StepReport& report);
  bool frame_due(std::int64_t step, double time) const;
  bool history_due(std::int64_t step) const;
  std::vector<std::string> fields_due(bool row, bool frame) const;
  bool last(std::int64_t step, double time) const;
  void write_frame(const StepReport& report);
  void look_for_crossed_faces(const StepReport& report);
  /// The frame that was begun, open for this rank to write a share of it; null where rank 0 writes all of it.
  std::unique_ptr<SharedFile> shared_frame();
  /// Of a state that is sampled. RunError where the energies of a dynamic run are far from adding up. recorded: the state counts
  /// in the balance of the run; not that of a stop alone.
  void watch_energies(const StepReport& report, bool recorded);
  /// What the end of the run warns of; empty where the energies add up.
  std::string energy_warning() const;
  /// counts: not a row of a stop alone.
  void write_history(const StepReport& report, bool counts);
  /// The first value of a column that is NaN after the start of the run is a warning.
  double derived_value(const HistoryDescription& record, std::span<const double> row, const StepReport& report);
  void progress(const StepReport& report);
  /// Whether a line of progress is due, which is then taken to be shown.
  bool line_due();
  void show(const std::string& line, bool end);

  Simulation& simulation_;
  std::filesystem::path folder_;
  std::unique_ptr<OutputFolder> output_;
  bool show_progress_;
  bool first_;  ///< rank 0, which alone writes
  PointFields fields_;
  std::vector<std::string> frame_fields_;
  std::vector<std::string> columns_;
  std::unique_ptr<FrameWriter> writer_;
  std::unique_ptr<HistoryWriter> history_;
  std::vector<double> frame_times_;
  OutputProgress done_;
  std::int64_t resumed_step_ = -1;
  std::string body_, libraries_;   ///< fingerprints
  std::string log_text_;
  std::chrono::steady_clock::time_point start_, shown_;
  bool line_open_ = false;
  bool stopping_ = false;
  /// Runs whose steps can be given up: where the last one ended, and whether its row and its frame are written.
  struct LastStep {
    StepReport report;
    std::vector<std::byte> state;
    bool row = false, frame = false;
  } last_step_;
  // Of this process; a resumed run does not know how long the earlier ones took.
  double output_seconds_ = 0;
  std::int64_t first_step_ = 0, frames_written_ = 0, rows_written_ = 0, checkpoints_written_ = 0;
  double first_time_ = 0;
  double time_step_ = 0;   ///< of the last step that was reported
  std::vector<std::string> warnings_;
  bool faces_crossed_ = false;             ///< a warning said so
  std::set<std::string> undefined_;        ///< columns that were not finite
  std::set<std::string> strange_fields_;   ///< that were not finite somewhere
  bool shares_frames_ = false;             ///< ranks write frames together
};

/// Asks a running RunRecorder to stop after the present step; safe in a signal handler.
void request_stop() noexcept;
bool stop_requested() noexcept;
/// While one lives a signal ends the program at once: nothing is on the disk yet, or will be.
class NothingToKeep {
 public:
  NothingToKeep() noexcept;
  ~NothingToKeep();
  NothingToKeep(const NothingToKeep&) = delete;
  NothingToKeep& operator=(const NothingToKeep&) = delete;
  static bool holds() noexcept;
};

}  // namespace perikit
