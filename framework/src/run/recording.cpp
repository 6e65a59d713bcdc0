#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <sstream>

#include "core/fingerprint.hpp"
#include "core/messages.hpp"
#include "files/atomic_file.hpp"
#include "files/shared_file.hpp"
#include "output/history_file.hpp"
#include "output/result_file.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"
#include "problem/snapshot.hpp"
#include "run/checkpoint.hpp"
#include "run/gathered_reference_configuration.hpp"
#include "run/gathering.hpp"
#include "run/reduction.hpp"
#include "run/run_folder.hpp"
#include "run/simulation.hpp"
#include "warnings/small_strains.hpp"

namespace perikit {

namespace {

std::atomic<bool> stop{false};
std::atomic<int> without_results{0};
constexpr std::int64_t default_frames = 20;
constexpr std::int64_t default_history_rows = 1000;

bool reached(double time, double wanted) { return time >= wanted - 1e-9 * std::abs(wanted); }

std::int64_t file_fingerprint(const std::filesystem::path& file) { return static_cast<std::int64_t>(fingerprint_of(file).value()); }

std::int64_t with_row(std::int64_t before, std::span<const double> row) {
  Fingerprint fingerprint = before == 0 ? Fingerprint() : Fingerprint(static_cast<std::uint64_t>(before));
  fingerprint.add(row);
  return static_cast<std::int64_t>(fingerprint.value());
}

/// What a run goes on from, from rank 0 to the others.
void share(Checkpoint& checkpoint) {
  if (communicator().size() == 1) return;
  // But for what only rank 0 looks at: the fingerprints of files.
  const auto each = [&](auto&& visit) {
    OutputProgress& o = checkpoint.output;
    for (std::int64_t* number : {&o.frames, &o.history_rows, &o.next_time, &o.history_every, &o.steps_expected, &checkpoint.step}) visit(*number);
    for (double* number : {&o.end_time, &o.frame_spacing, &o.energies.initial, &o.energies.largest, &o.energies.off, &checkpoint.time}) visit(*number);
  };
  ByteWriter out;
  each([&](auto& value) { out.value(value); });
  std::vector<std::byte> head = out.take();
  communicator().broadcast(head);
  ByteReader in(head);
  each([&](auto& value) { value = in.value<std::remove_reference_t<decltype(value)>>(); });
}

}  // namespace

void request_stop() noexcept { stop = true; }
bool stop_requested() noexcept { return stop; }

NothingToKeep::NothingToKeep() noexcept { ++without_results; }
NothingToKeep::~NothingToKeep() { --without_results; }
bool NothingToKeep::holds() noexcept { return without_results > 0; }

std::vector<std::string> history_columns(const Scene& scene, bool laws_dissipate) {
  std::vector<std::string> columns = fixed_history_columns();
  if (!laws_dissipate) columns.pop_back();
  for (const HistoryDescription& record : scene.output.history) columns.push_back(record.name);
  return columns;
}

RunRecorder::RunRecorder(Simulation& simulation, std::filesystem::path folder, bool show_progress, RunStart start,
                         std::string libraries, bool force)
    : simulation_(simulation),
      folder_(std::move(folder)),
      show_progress_(show_progress && communicator().rank() == 0),
      first_(communicator().rank() == 0),
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
  columns_ = perikit::history_columns(scene, simulation.problem().dissipates());
  GatheredReferenceConfiguration reference(simulation.problem());
  reference.use([&](const ReferenceData& data) { body_ = body_fingerprint(data); });
  if (first_) output_ = std::make_unique<OutputFolder>(folder_, use_of_folder(scene, folder_, force));
  const bool earlier = communicator().largest(first_ && start == RunStart::resume && std::filesystem::exists(checkpoint_file(folder_)) ? 1 : 0) > 0;
  if (earlier) start_from_checkpoint();
  else if (first_) start_fresh(start);
  reference.use([&](const ReferenceData& data) {
    writer_ = std::make_unique<FrameWriter>(folder_, data, RunAttributes{PERIKIT_VERSION, scene.title, scene.text}, done_.frames);
  });
  shares_frames_ = simulation.problem().partition() && simulation.problem().points().size_on_all_ranks() > most_points_gathered();
  if (!first_) return;
  std::vector<std::string> missing;
  for (const HistoryDescription& record : scene.output.history)
    if (record.may_be_missing()) missing.push_back(record.name);
  history_ = std::make_unique<HistoryWriter>(folder_ / "history.csv", columns_, earlier ? done_.history_rows : -1, missing);
  if (shares_frames_) log("frames        written by all ranks");
}

void RunRecorder::start_fresh(RunStart start) {
  const Scene& scene = simulation_.scene();
  // Without a checkpoint the earlier run came to none; of the same scene it begins again, any other keeps its results.
  if (const auto before = read_marked(folder_ / "scene.toml"); start == RunStart::resume && before)
    check_same_scene(before->text, scene, folder_);
  const std::string replaced = start == RunStart::fresh ? earlier_run(folder_) : std::string();
  // Before any other file: no checkpoint may stand beside the frames of another run.
  remove_file(checkpoint_file(folder_));
  if (!replaced.empty()) {
    log(replaced);
    if (show_progress_) tell(replaced + '\n');
  }
  output_->mark(scene.resolved);
}

void RunRecorder::start_from_checkpoint() {
  Checkpoint checkpoint;
  bool lengthened = false;
  if (first_) {
    checkpoint = read_checkpoint(folder_);
    lengthened = check_checkpoint(checkpoint, simulation_.scene(), body_, libraries_, folder_);
  }
  share(checkpoint);
  lengthened = communicator().largest(lengthened ? 1 : 0) > 0;
  try {
    ByteReader state = checkpoint_state(folder_, true);
    simulation_.problem().restore(state);
  } catch (const InputError& error) {
    throw InputError({checkpoint_file(folder_).string()}, "state", error.what());
  }
  done_ = checkpoint.output;
  if (lengthened) check_longer();
  if (first_) check_kept_files();
  resumed_step_ = first_step_ = checkpoint.step;
  first_time_ = checkpoint.time;
  if (!first_) return;
  log_text_ = read_text(folder_ / "run.log");
  if (const auto marked = read_marked(folder_ / "scene.toml"); !marked || marked->text != simulation_.scene().resolved) output_->mark(simulation_.scene().resolved);
}

void RunRecorder::check_longer() const {
  State& state = simulation_.problem().state();
  const ParameterValues& values = simulation_.scene().integrator->values;
  const std::string& type = simulation_.scene().integrator->type;
  // What an integrator plans for is in its state where it can plan anew.
  if (state.declare_numbers("planned_end", 1)[0] == 0)
    throw InputError(values.position("type"), "integrator", fmt::format("found another end than the run in {} had, and {} cannot plan anew; allowed: the same end", folder_.string(), type));
  if (simulation_.dynamic() && values.has("end_time") && values.number("end_time") < state.time)
    throw values.error("end_time", fmt::format("found {} s, but the run in {} has come to {:.6g} s; allowed: a later end", values.number("end_time"), folder_.string(), state.time));
  if (!simulation_.dynamic() && state.time >= 1)
    throw values.error("steps", fmt::format("found a run in {} that has come to its end, load parameter 1; allowed: other steps where it has not", folder_.string()));
}

void RunRecorder::check_kept_files() const {
  const auto refuse = [](const std::filesystem::path& file) {
    throw InputError({file.string()}, "", "found other contents than the run wrote before its checkpoint; allowed: the files as they were, or a run without --resume");
  };
  for (std::size_t k = 0; k < done_.frame_fingerprints.size(); ++k)
    if (const auto file = frame_file(static_cast<std::int64_t>(k)); file_fingerprint(file) != done_.frame_fingerprints[k]) refuse(file);
  if (done_.history_rows == 0) return;
  const std::filesystem::path file = folder_ / "history.csv";
  const History history = read_history(file);
  std::int64_t fingerprint = 0;
  std::vector<double> row(history.columns.size());
  const auto rows = static_cast<std::size_t>(done_.history_rows);
  if (history.values.empty() || history.values.front().size() < rows) refuse(file);
  for (std::size_t k = 0; k < rows; ++k) {
    for (std::size_t c = 0; c < row.size(); ++c) row[c] = history.values[c][k];
    fingerprint = with_row(fingerprint, row);
  }
  if (fingerprint != done_.history_fingerprint) refuse(file);
}

std::filesystem::path RunRecorder::frame_file(std::int64_t index) const { return folder_ / "frames" / (frame_name(index) + ".h5"); }

RunRecorder::~RunRecorder() {
  if (line_open_) std::fputc('\n', stderr);
}

void RunRecorder::log(std::string_view message) {
  if (!first_) return;
  const std::vector<std::string>& silence = simulation_.scene().silence;
  std::istringstream lines{std::string(message)};
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("warning")) {
      if (std::ranges::find(silence, warning_name(line)) != silence.end()) continue;
      warnings_.push_back(line);
    }
    log_text_ += line + '\n';
  }
  write_file_atomically(folder_ / "run.log", log_text_);
}

bool RunRecorder::cancelled() const noexcept { return stopping_; }

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
  return time >= static_cast<double>(done_.frames) * done_.frame_spacing * (1 - 1e-9) || last(step, time);
}

bool RunRecorder::history_due(std::int64_t step) const {
  return step == 0 || done_.history_every <= 1 || step % done_.history_every == 0 || (done_.steps_expected > 0 && step >= done_.steps_expected);
}

bool RunRecorder::checkpoint_due(std::int64_t step, double time) const {
  const std::int64_t every = simulation_.scene().output.checkpoint_every;
  return every > 0 && step > 0 && (step % every == 0 || last(step, time));
}

bool RunRecorder::wants_sample(std::int64_t step, double time) {
  // Read once a step and before its end, so that the state that a stop keeps is a whole sample; a signal that comes later ends
  // the run after the next step.
  stopping_ = communicator().largest(stop_requested() ? 1 : 0) > 0;
  const bool row = stopping_ || history_due(step), frame = stopping_ || frame_due(step, time);
  // Steps of other runs evaluate forces many times.
  if (simulation_.dynamic()) fields_.expect_after_step(fields_due(row, frame));
  return row || frame;
}

/// What rows and frames hold: sampled once for all that is written.
std::vector<std::string> RunRecorder::fields_due(bool row, bool frame) const {
  std::vector<std::string> wanted;
  for (const HistoryDescription& record : simulation_.scene().output.history)
    if (row && !record.value) wanted.push_back(record.quantity);
  if (frame) wanted.insert(wanted.end(), frame_fields_.begin(), frame_fields_.end());
  if (frame && simulation_.small_strains().watched()) wanted.emplace_back("deformation_gradient");
  return wanted;
}

void RunRecorder::step_done(const StepReport& report) {
  if (report.step <= resumed_step_) return;   // an integrator without steps reports its one state again
  time_step_ = report.time_step;
  done_.end_time = report.end_time;
  done_.steps_expected = report.steps_expected;
  if (done_.frame_spacing == 0) done_.frame_spacing = report.end_time / static_cast<double>(simulation_.scene().output.frames.value_or(default_frames));
  if (done_.history_every == 0) {
    const std::int64_t asked = simulation_.scene().output.history_every;
    done_.history_every = asked > 0 ? asked : simulation_.dynamic() ? std::max<std::int64_t>(1, report.steps_expected / default_history_rows) : 1;
  }
  fields_.renew();
  const auto before = std::chrono::steady_clock::now();
  // What only the stop asks for is written but not counted: the run that goes on writes what the run without a stop had written.
  const bool row = history_due(report.step), frame = frame_due(report.step, report.time);
  if (row || frame || stopping_) watch_energies(report, row || frame);
  fields_.expect(fields_due(row || stopping_, frame || stopping_));
  if (simulation_.small_strains().watched() && (frame || stopping_))
    if (const std::string warning = simulation_.small_strains().look(fields_, report.time); !warning.empty()) log(warning);
  if (row || stopping_) write_history(report, row);
  if (frame || stopping_) write_frame(report);
  done_.history_rows += row;
  done_.frames += frame;
  while (done_.next_time < std::ssize(frame_times_) && reached(report.time, frame_times_[static_cast<std::size_t>(done_.next_time)])) ++done_.next_time;
  if (report.step == 0 && report.end_time > 0 && !frame_times_.empty() && !reached(report.end_time, frame_times_.back())) {
    log(named("output_times", fmt::format("warning: [output] times: {} lies after the end of the run, {}: no frame", frame_times_.back(),
                    report.end_time)));
  }
  if (stopping_ || checkpoint_due(report.step, report.time)) keep_checkpoint(report);
  if (simulation_.quasi_static()) last_step_ = {report, simulation_.problem().snapshot(), row || stopping_, frame || stopping_};
  output_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  progress(report);
}

bool RunRecorder::interrupted() const noexcept {
  return communicator().largest(stop_requested() ? 1 : 0) > 0;
}

void RunRecorder::stopped_within_step() {
  stopping_ = true;
  simulation_.problem().restore(last_step_.state);
  fields_.renew();
  if (!last_step_.row) write_history(last_step_.report, false);
  if (!last_step_.frame) write_frame(last_step_.report);
  keep_checkpoint(last_step_.report);
  log(fmt::format("stopped within step {}, which was given up", last_step_.report.step + 1));
}

void RunRecorder::working(std::string_view what) {
  if (line_due()) show(fmt::format("step {}  {}  {:.0f} s", last_step_.report.step + 1, what, std::chrono::duration<double>(shown_ - start_).count()), false);
}

void RunRecorder::keep_checkpoint(const StepReport& report) {
  ++checkpoints_written_;
  if (first_) {
    finish();
    history_->sync();
  }
  for (std::int64_t k = std::ssize(done_.frame_fingerprints); first_ && k < done_.frames; ++k)
    done_.frame_fingerprints.push_back(file_fingerprint(frame_file(k)));
  std::optional<NewCheckpoint> checkpoint;
  simulation_.problem().write_snapshot(
      [&](std::uint64_t size) {
        checkpoint.emplace(
            folder_,
            Checkpoint{PERIKIT_VERSION, simulation_.scene().resolved, body_, libraries_, done_, report.step, report.time}, size);
      },
      [&](std::span<const std::byte> piece) { checkpoint->add(piece); });
  if (first_) checkpoint->keep();
}

void RunRecorder::finish() {
  if (writer_) writer_->finish();
}

std::unique_ptr<SharedFile> RunRecorder::shared_frame() {
  if (!shares_frames_) return nullptr;
  std::vector<char> name;
  if (first_) name.assign(writer_->file().native().begin(), writer_->file().native().end());
  name = told_to_all(name);
  auto file = std::make_unique<SharedFile>(std::string(name.begin(), name.end()));
  const std::string refusal = first_message(file->refusal());
  if (refusal.empty()) return file;
  log("frames        written by rank 0 alone, as " + refusal);
  shares_frames_ = false;
  return nullptr;
}

void RunRecorder::write_frame(const StepReport& report) {
  if (first_) writer_->begin(report.time, report.step);
  const std::unique_ptr<SharedFile> shared = shared_frame();
  fields_.expect(frame_fields_);
  for (const std::string& name : frame_fields_) {
    const OutputField& mine = fields_.get(name);
    const auto width = static_cast<std::size_t>(mine.width);
    constexpr double none = 1e300;
    double strange = none;  // the first point that is not finite
    const auto look = [&](std::size_t first, std::span<const double> rows) {
      const auto found = std::ranges::find_if(rows, [](double value) { return !std::isfinite(value); });
      if (found != rows.end())
        strange = std::min(strange, static_cast<double>(first + static_cast<std::size_t>(found - rows.begin()) / width));
    };
    if (shared) {
      const std::uint64_t begin =
          told_to_all(first_ ? std::vector{writer_->reserve(name, mine.width, mine.unit)} : std::vector<std::uint64_t>()).front();
      share_points(simulation_.problem(), mine.data, width, [&](std::size_t first, std::span<const double> rows) {
        shared->write(begin + first * width * sizeof(double), rows);
        look(first, rows);
      });
      strange = -communicator().largest(-strange);
    } else {
      gather_points(simulation_.problem(), mine.data, width, [&](std::size_t first, std::span<const double> rows) {
        writer_->add(name, mine.width, rows, mine.unit);
        look(first, rows);
      });
    }
    if (strange < none && strange_fields_.insert(name).second)
      log(named("not_finite", fmt::format("warning: frame {}: {} is not finite at point {} (in input order){}", frames(), name, strange,
                      name == "shape_tensor_condition" ? ", whose family is too poor for a gradient" : "")));
    fields_.forget(name);
  }
  fields_.renew();
  ++frames_written_;
  if (!faces_crossed_) look_for_crossed_faces(report);
  if (shared)
    if (const std::string error = first_message(shared->close()); !error.empty()) throw RunError(error);
  if (first_) writer_->end();
}

void RunRecorder::look_for_crossed_faces(const StepReport& report) {
  const std::string crossed = simulation_.problem().crossed_faces();
  if (crossed.empty()) return;
  faces_crossed_ = true;
  log(named("contact", fmt::format("warning: {} {:.6g}: {}; what comes after is right only where faces that meet carry nothing", simulation_.dynamic() ? "time" : "load",
                  report.time, crossed)));
}

void RunRecorder::write_history(const StepReport& report, bool counts) {
  BodyProblem& problem = simulation_.problem();
  const Energies& energies = problem.state().energies;
  std::vector<double> row{static_cast<double>(report.step),
                          report.time,
                          report.time_step,
                          energies.strain,
                          energies.kinetic,
                          energies.external_work,
                          energies.dissipated,
                          static_cast<double>(report.iterations),
                          report.residual};
  if (problem.dissipates()) row.push_back(energies.dissipated_by_laws);
  const OutputDescription& output = simulation_.scene().output;
  for (const HistoryDescription& record : output.history) {
    row.push_back(record.value ? 0 : reduced(record, problem, fields_, report.time));
    if (record.quantity == "shape_tensor_condition" && !std::isfinite(row.back()) && undefined_.insert(record.name).second)
      log(named("not_finite", fmt::format("warning: history column {} is {} at t = {:.6g}: a point of its set has a family too poor for a gradient", record.name,
                      row.back(), report.time)));
  }
  for (const std::size_t k : output.derived) row[columns_.size() - output.history.size() + k] = derived_value(output.history[k], row, report);
  if (counts) done_.history_fingerprint = with_row(done_.history_fingerprint, row);
  ++rows_written_;
  if (first_) history_->row(row);
}

double RunRecorder::derived_value(const HistoryDescription& record, std::span<const double> row, const StepReport& report) {
  std::vector<double> values;
  for (const std::string& name : record.value->columns()) values.push_back(row[static_cast<std::size_t>(std::ranges::find(columns_, name) - columns_.begin())]);
  const double value = (*record.value)(values, report.time);
  const bool follows = std::ranges::any_of(values, [](double given) { return std::isnan(given); });   // from a column that is missing itself
  if (!std::isnan(value) || follows) return value;
  const bool at_start = report.step == 0 && !last(report.step, report.time);   // where nothing has happened 0/0 is as it should be
  if (at_start || !undefined_.insert(record.name).second) return value;
  std::string given;
  for (std::size_t k = 0; k < values.size(); ++k) given += fmt::format("{}{} = {:.6g}", k == 0 ? "" : ", ", record.value->columns()[k], values[k]);
  log(named("not_finite", fmt::format("warning: history column {}: {} is no finite number at t = {:.6g}, where {}; nan stands in its place", record.name, record.value->text(), report.time, given)));
  return value;
}

bool RunRecorder::line_due() {
  const auto now = std::chrono::steady_clock::now();
  if (!show_progress_ || now - shown_ < (isatty(fileno(stderr)) ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000))) return false;
  shown_ = now;
  return true;
}

void RunRecorder::show(const std::string& line, bool end) {
  if (isatty(fileno(stderr))) {
    tell("\r\033[K" + line);
    line_open_ = !end;
    if (end) std::fputc('\n', stderr);
  } else {
    tell(line + '\n');
  }
}

void RunRecorder::progress(const StepReport& report) {
  const bool end = last(report.step, report.time);
  if (!line_due() && !(end && show_progress_)) return;
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double done = report.end_time > first_time_ ? (report.time - first_time_) / (report.end_time - first_time_) : 1.0;
  const double left = done > 0 ? spent * (1 - done) / done : 0.0;
  if (!simulation_.dynamic()) {
    show(fmt::format("step {}  load {:.4g}/{:.4g}  {} iterations  residual {:.2g}  {:.0f} s left", report.step, report.time, report.end_time, report.iterations,
                     report.residual, left), end);
    return;
  }
  const double rate = static_cast<double>(report.step - first_step_) * static_cast<double>(simulation_.problem().points().size_on_all_ranks()) / std::max(spent, 1e-9);
  show(fmt::format("step {}  time {:.4g}/{:.4g}  dt {:.3g}  {:.3g} points/s  {:.0f} s left", report.step, report.time, report.end_time, report.time_step, rate, left), end);
}

}  // namespace perikit
