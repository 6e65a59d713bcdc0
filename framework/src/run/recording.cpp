#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <sstream>

#include "files/atomic_file.hpp"
#include "perikit/problem/motion.hpp"
#include "perikit/run/simulation.hpp"
#include "run/checkpoint.hpp"
#include "run/reduction.hpp"

namespace perikit {

namespace {

std::atomic<bool> stop{false};
constexpr std::int64_t default_frames = 20;
constexpr std::int64_t default_history_rows = 1000;

bool reached(double time, double wanted) {
  return time >= wanted - 1e-9 * std::abs(wanted);
}

bool ended(const OutputProgress& run, std::int64_t step, double time) {
  return (run.steps_expected > 0 && step >= run.steps_expected) || (run.end_time > 0 && time >= run.end_time * (1 - 1e-12));
}

/// What a run that does not go on does to the one whose results the folder holds; empty where it holds none.
std::string earlier_run(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "scene.toml")) return {};
  if (std::filesystem::exists(checkpoint_file(folder))) {
    try {
      const Checkpoint checkpoint = read_checkpoint(folder);
      if (!ended(checkpoint.output, checkpoint.step, checkpoint.time)) {
        return fmt::format(
            "warning: replaces a run in {} that was stopped and kept a checkpoint at step {}, time {:.6g} s: --resume would have "
            "gone on with it",
            folder.string(), checkpoint.step, checkpoint.time);
      }
    } catch (const InputError&) {  // nothing that could be gone on with
    }
  }
  return fmt::format("replaces the results of an earlier run in {}", folder.string());
}

ReferenceData reference_of(const BodyProblem& problem) {
  const Body& body = problem.body();
  ReferenceData data;
  for (std::size_t p = 0; p < body.owned().size(); ++p) {
    const auto i = static_cast<std::size_t>(body.owned()[p]);
    const Point x = body.position(i);
    data.position.insert(data.position.end(), x.begin(), x.end());
    data.volume.push_back(body.volume(i));
    data.id.push_back(static_cast<std::int64_t>(p));
    data.material_id.push_back(body.material_ids().empty() ? 0 : body.material_ids()[i]);
  }
  for (const auto& [name, members] : body.sets()) {
    if (name == "all") continue;
    std::vector<std::int64_t>& set = data.sets[name];
    for (const std::int32_t i : members) set.push_back(body.input_of(static_cast<std::size_t>(i)));
    std::sort(set.begin(), set.end());
  }
  return data;
}

}  // namespace

void request_stop() noexcept {
  stop = true;
}
bool stop_requested() noexcept {
  return stop;
}

std::vector<std::string> history_columns(const Scene& scene) {
  std::vector<std::string> columns{"step",           "time",          "time_step",         "strain_energy",
                                   "kinetic_energy", "external_work", "dissipated_energy", "iterations",
                                   "residual"};
  for (const HistoryDescription& record : scene.output.history) columns.push_back(record.name);
  return columns;
}

RunRecorder::RunRecorder(Simulation& simulation, std::filesystem::path folder, bool show_progress, RunStart start,
                         std::string libraries)
    : simulation_(simulation),
      folder_(std::move(folder)),
      show_progress_(show_progress),
      fields_(simulation.problem(), simulation.dynamic(), !simulation.scene().initial_velocity.empty()),
      libraries_(std::move(libraries)),
      start_(std::chrono::steady_clock::now()),
      shown_(start_) {
  const Scene& scene = simulation.scene();
  frame_fields_ = scene.output.fields;
  if (frame_fields_.empty()) {
    frame_fields_.push_back("displacement");
    if (simulation.dynamic()) frame_fields_.push_back("velocity");
    frame_fields_.push_back("strain_energy_density");
    if (scene.damage || !scene.cracks.empty()) frame_fields_.push_back("damage");
  }
  frame_times_ = scene.output.times;
  std::sort(frame_times_.begin(), frame_times_.end());
  columns_ = perikit::history_columns(scene);
  const ReferenceData reference = reference_of(simulation.problem());
  body_ = body_fingerprint(reference);
  make_folder(folder_);
  remove_file(temporary_name(checkpoint_file(folder_)));  // of a run that was killed
  const bool earlier = start == RunStart::resume && std::filesystem::exists(checkpoint_file(folder_));
  if (earlier)
    start_from_checkpoint();
  else
    start_fresh(start);
  writer_ =
      std::make_unique<FrameWriter>(folder_, reference, RunAttributes{PERIKIT_VERSION, scene.title, scene.text}, done_.frames);
  history_ = std::make_unique<HistoryWriter>(folder_ / "history.csv", columns_, earlier ? done_.history_rows : -1);
}

void RunRecorder::start_fresh(RunStart start) {
  const Scene& scene = simulation_.scene();
  // Without a checkpoint the earlier run came to none; of the same scene it begins again, any other keeps its results.
  if (start == RunStart::resume && std::filesystem::exists(folder_ / "scene.toml"))
    check_same_scene(read_text(folder_ / "scene.toml"), scene, folder_);
  std::error_code missing;
  if (std::filesystem::equivalent(scene.file, folder_ / "scene.toml", missing) && read_text(scene.file) != scene.resolved) {
    throw InputError({scene.file.string()}, "output",
                     fmt::format("found {}, the folder of the scene itself, whose scene.toml the resolved scene would replace; "
                                 "allowed: another folder (-o)",
                                 folder_.string()));
  }
  const std::string replaced = start == RunStart::fresh ? earlier_run(folder_) : std::string();
  // Before any other file: no checkpoint may stand beside the frames of another run.
  remove_file(checkpoint_file(folder_));
  if (!replaced.empty()) {
    log(replaced);
    if (show_progress_) fmt::print(stderr, "{}\n", replaced);
  }
  write_file_atomically(folder_ / "scene.toml", scene.resolved);
}

void RunRecorder::start_from_checkpoint() {
  const Checkpoint checkpoint = read_checkpoint(folder_);
  check_checkpoint(checkpoint, simulation_.scene(), body_, libraries_, folder_);
  try {
    simulation_.problem().restore(checkpoint.state);
  } catch (const InputError& error) {
    throw InputError({checkpoint_file(folder_).string()}, "state", error.what());
  }
  done_ = checkpoint.output;
  resumed_step_ = first_step_ = checkpoint.step;
  first_time_ = checkpoint.time;
  log_text_ = read_text(folder_ / "run.log");
}

RunRecorder::~RunRecorder() {
  if (line_open_) std::fputc('\n', stderr);
}

void RunRecorder::log(std::string_view message) {
  std::istringstream lines{std::string(message)};
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("warning")) warnings_.push_back(line);
  log_text_ += message;
  if (log_text_.empty() || log_text_.back() != '\n') log_text_ += '\n';
  write_file_atomically(folder_ / "run.log", log_text_);
}

bool RunRecorder::cancelled() const noexcept {
  return stopping_;
}

bool RunRecorder::last(std::int64_t step, double time) const {
  return ended(done_, step, time);
}

bool RunRecorder::frame_due(std::int64_t step, double time) const {
  const OutputDescription& output = simulation_.scene().output;
  const auto next = static_cast<std::size_t>(done_.next_time);
  if (!frame_times_.empty()) return next < frame_times_.size() && reached(time, frame_times_[next]);
  if (output.every) return step % *output.every == 0 || last(step, time);
  if (step == 0) return true;
  if (done_.end_time <= 0) return true;
  const auto frames = static_cast<double>(output.frames.value_or(default_frames));
  return time >= static_cast<double>(done_.frames) * done_.end_time / frames * (1 - 1e-9) || last(step, time);
}

bool RunRecorder::history_due(std::int64_t step) const {
  return step == 0 || done_.history_every <= 1 || step % done_.history_every == 0 ||
         (done_.steps_expected > 0 && step >= done_.steps_expected);
}

bool RunRecorder::checkpoint_due(std::int64_t step, double time) const {
  const std::int64_t every = simulation_.scene().output.checkpoint_every;
  return every > 0 && step > 0 && (step % every == 0 || last(step, time));
}

bool RunRecorder::wants_sample(std::int64_t step, double time) {
  // Read once a step and before its end, so that the state that a stop keeps is a whole sample; a signal that comes later ends
  // the run after the next step.
  stopping_ = stop_requested();
  return stopping_ || frame_due(step, time) || history_due(step);
}

void RunRecorder::step_done(const StepReport& report) {
  if (report.step <= resumed_step_) return;  // an integrator without steps reports its one state again
  done_.end_time = report.end_time;
  done_.steps_expected = report.steps_expected;
  if (done_.history_every == 0) {
    const std::int64_t asked = simulation_.scene().output.history_every;
    done_.history_every = asked > 0               ? asked
                          : simulation_.dynamic() ? std::max<std::int64_t>(1, report.steps_expected / default_history_rows)
                                                  : 1;
  }
  fields_.renew();
  const auto before = std::chrono::steady_clock::now();
  // What only the stop asks for is written but not counted: the run that goes on writes what the run without a stop had written.
  const bool row = history_due(report.step), frame = frame_due(report.step, report.time);
  if (row || stopping_) write_history(report);
  if (frame || stopping_) write_frame(report);
  done_.history_rows += row;
  done_.frames += frame;
  while (done_.next_time < std::ssize(frame_times_) &&
         reached(report.time, frame_times_[static_cast<std::size_t>(done_.next_time)]))
    ++done_.next_time;
  if (report.step == 0 && report.end_time > 0 && !frame_times_.empty() && !reached(report.end_time, frame_times_.back())) {
    log(fmt::format("warning: [output] times: {} lies after the end of the run, {}: no frame", frame_times_.back(),
                    report.end_time));
  }
  if (report.step == 0)
    done_.initial_energy = simulation_.problem().state().energies.strain + simulation_.problem().state().energies.kinetic;
  if (stopping_ || checkpoint_due(report.step, report.time)) keep_checkpoint(report);
  if (simulation_.quasi_static()) last_step_ = {report, simulation_.problem().snapshot(), row || stopping_, frame || stopping_};
  output_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  progress(report);
}

bool RunRecorder::interrupted() const noexcept {
  return stop_requested();
}

void RunRecorder::stopped_within_step() {
  stopping_ = true;
  simulation_.problem().restore(last_step_.state);
  fields_.renew();
  if (!last_step_.row) write_history(last_step_.report);
  if (!last_step_.frame) write_frame(last_step_.report);
  keep_checkpoint(last_step_.report);
  log(fmt::format("stopped within step {}, which was given up", last_step_.report.step + 1));
}

void RunRecorder::working(std::string_view what) {
  if (line_due())
    show(fmt::format("step {}  {}  {:.0f} s", last_step_.report.step + 1, what,
                     std::chrono::duration<double>(shown_ - start_).count()),
         false);
}

void RunRecorder::keep_checkpoint(const StepReport& report) {
  ++checkpoints_written_;
  history_->sync();  // frames are on the disk already
  write_checkpoint(folder_, {PERIKIT_VERSION, simulation_.scene().resolved, body_, libraries_, done_, report.step, report.time,
                             simulation_.problem().snapshot()});
}

void RunRecorder::write_frame(const StepReport& report) {
  std::vector<OutputField> fields;
  for (const std::string& name : frame_fields_) fields.push_back(fields_.get(name));
  writer_->write(report.time, report.step, fields);
  ++frames_written_;
}

void RunRecorder::write_history(const StepReport& report) {
  BodyProblem& problem = simulation_.problem();
  Energies& energies = problem.state().energies;
  if (simulation_.dynamic()) energies.kinetic = kinetic_energy(problem, problem.state().velocity());
  std::vector<double> row{static_cast<double>(report.step),
                          report.time,
                          report.time_step,
                          energies.strain,
                          energies.kinetic,
                          energies.external_work,
                          energies.dissipated,
                          static_cast<double>(report.iterations),
                          report.residual};
  for (const HistoryDescription& record : simulation_.scene().output.history)
    row.push_back(reduced(record, problem.body(), fields_.get(record.quantity), report.time));
  history_->row(row);
  ++rows_written_;
}

bool RunRecorder::line_due() {
  const auto now = std::chrono::steady_clock::now();
  if (!show_progress_ ||
      now - shown_ < (isatty(fileno(stderr)) ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000)))
    return false;
  shown_ = now;
  return true;
}

void RunRecorder::show(const std::string& line, bool end) {
  if (isatty(fileno(stderr))) {
    fmt::print(stderr, "\r\033[K{}", line);
    line_open_ = !end;
    if (end) std::fputc('\n', stderr);
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
}

void RunRecorder::progress(const StepReport& report) {
  const bool end = last(report.step, report.time);
  if (!line_due() && !(end && show_progress_)) return;
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double done = report.end_time > first_time_ ? (report.time - first_time_) / (report.end_time - first_time_) : 1.0;
  const double left = done > 0 ? spent * (1 - done) / done : 0.0;
  if (!simulation_.dynamic()) {
    show(fmt::format("step {}  load {:.4g}/{:.4g}  {} iterations  residual {:.2g}  {:.0f} s left", report.step, report.time,
                     report.end_time, report.iterations, report.residual, left),
         end);
    return;
  }
  const double rate = static_cast<double>(report.step - first_step_) *
                      static_cast<double>(simulation_.problem().body().points_of_all_ranks()) / std::max(spent, 1e-9);
  show(fmt::format("step {}  time {:.4g}/{:.4g}  dt {:.3g}  {:.3g} points/s  {:.0f} s left", report.step, report.time,
                   report.end_time, report.time_step, rate, left),
       end);
}

}  // namespace perikit
