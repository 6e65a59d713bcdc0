#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>

#include "perikit/run/simulation.hpp"

namespace perikit {

namespace {

std::atomic<bool> stop_requested{false};
constexpr std::int64_t default_frames = 20;
constexpr std::int64_t default_history_rows = 1000;

ReferenceData reference_of(const BodyProblem& problem) {
  const Body& body = problem.body();
  ReferenceData data;
  for (std::size_t p = 0; p < body.points(); ++p) {
    const auto i = static_cast<std::size_t>(body.internal()[p]);
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

void request_stop() noexcept { stop_requested = true; }

RunRecorder::RunRecorder(Simulation& simulation, std::filesystem::path folder, bool show_progress)
    : simulation_(simulation), folder_(std::move(folder)), show_progress_(show_progress),
      fields_(simulation.problem(), simulation.dynamic()), start_(std::chrono::steady_clock::now()), shown_(start_) {
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
  writer_ = std::make_unique<FrameWriter>(folder_, reference_of(simulation.problem()), RunAttributes{PERIKIT_VERSION, scene.title, scene.text});
  write_file_atomically(folder_ / "scene.toml", scene.resolved);
  columns_ = {"step", "time", "time_step", "strain_energy", "kinetic_energy", "external_work", "dissipated_energy", "iterations", "residual"};
  for (const HistoryDescription& record : scene.output.history) columns_.push_back(record.name);
  history_ = std::make_unique<HistoryWriter>(folder_ / "history.csv", columns_);
}

RunRecorder::~RunRecorder() {
  if (line_open_) std::fputc('\n', stderr);
}

void RunRecorder::log(std::string_view message) {
  log_text_ += message;
  if (log_text_.empty() || log_text_.back() != '\n') log_text_ += '\n';
  write_file_atomically(folder_ / "run.log", log_text_);
}

bool RunRecorder::cancelled() const noexcept { return stopping_; }

bool RunRecorder::last(std::int64_t step, double time) const {
  return (steps_expected_ > 0 && step >= steps_expected_) || (end_time_ > 0 && time >= end_time_ * (1 - 1e-12));
}

bool RunRecorder::frame_due(std::int64_t step, double time) const {
  const OutputDescription& output = simulation_.scene().output;
  if (!frame_times_.empty()) return next_time_ < frame_times_.size() && time >= frame_times_[next_time_] - 1e-9 * std::abs(frame_times_[next_time_]);
  if (output.every) return step % *output.every == 0 || last(step, time);
  if (step == 0) return true;
  if (end_time_ <= 0) return true;
  const auto frames = static_cast<double>(output.frames.value_or(default_frames));
  return time >= static_cast<double>(writer_->frames()) * end_time_ / frames * (1 - 1e-9) || last(step, time);
}

bool RunRecorder::history_due(std::int64_t step) const {
  return step == 0 || history_every_ <= 1 || step % history_every_ == 0 || (steps_expected_ > 0 && step >= steps_expected_);
}

bool RunRecorder::wants_sample(std::int64_t step, double time) { return frame_due(step, time) || history_due(step); }

void RunRecorder::step_done(const StepReport& report) {
  end_time_ = report.end_time;
  steps_expected_ = report.steps_expected;
  if (history_every_ == 0) {
    const std::int64_t asked = simulation_.scene().output.history_every;
    history_every_ = asked > 0 ? asked : simulation_.dynamic() ? std::max<std::int64_t>(1, report.steps_expected / default_history_rows) : 1;
  }
  fields_.renew();
  // Read once a step: a signal that comes while this step is written ends the run after the next one, whose state is then kept.
  stopping_ = stop_requested;
  if (history_due(report.step) || stopping_) write_history(report);
  if (frame_due(report.step, report.time) || stopping_) write_frame(report);
  progress(report);
}

void RunRecorder::write_frame(const StepReport& report) {
  std::vector<OutputField> fields;
  for (const std::string& name : frame_fields_) fields.push_back(fields_.get(name));
  writer_->write(report.time, report.step, fields);
  while (next_time_ < frame_times_.size() && report.time >= frame_times_[next_time_] - 1e-9 * std::abs(frame_times_[next_time_])) ++next_time_;
}

double RunRecorder::reduce(const HistoryDescription& record) {
  const OutputField& field = fields_.get(record.quantity);
  const Body& body = simulation_.problem().body();
  const int column = PointFields::column(record.quantity, record.component);
  const auto w = static_cast<std::size_t>(field.width);
  double sum = 0, least = INFINITY, most = -INFINITY;
  const auto& members = body.set(record.set);
  for (const std::int32_t index : members) {
    const double* row = &field.data[w * static_cast<std::size_t>(body.input_of(static_cast<std::size_t>(index)))];
    double value = 0;
    if (column >= 0) {
      value = row[column];
    } else {
      for (std::size_t c = 0; c < w; ++c) value += row[c] * row[c];
      value = std::sqrt(value);
    }
    sum += value;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (record.reduce == "sum") return sum;
  if (record.reduce == "min") return least;
  if (record.reduce == "max") return most;
  return sum / static_cast<double>(members.size());
}

void RunRecorder::write_history(const StepReport& report) {
  BodyProblem& problem = simulation_.problem();
  Energies& energies = problem.energies();
  if (simulation_.dynamic()) energies.kinetic = problem.kinetic_energy(problem.velocity());
  std::vector<double> row{static_cast<double>(report.step), report.time, report.time_step, energies.strain, energies.kinetic,
                          energies.external_work, energies.dissipated, static_cast<double>(report.iterations), report.residual};
  for (const HistoryDescription& record : simulation_.scene().output.history) row.push_back(reduce(record));
  history_->row(row);
}

void RunRecorder::progress(const StepReport& report) {
  if (!show_progress_) return;
  const auto now = std::chrono::steady_clock::now();
  const bool terminal = isatty(fileno(stderr));
  const bool end = last(report.step, report.time);
  if (!end && now - shown_ < (terminal ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000))) return;
  shown_ = now;
  const double spent = std::chrono::duration<double>(now - start_).count();
  const double done = report.end_time > 0 ? report.time / report.end_time : 1.0;
  const double rate = static_cast<double>(report.step) * static_cast<double>(simulation_.problem().points()) / std::max(spent, 1e-9);
  const std::string line = fmt::format("step {}  time {:.4g}/{:.4g}  dt {:.3g}  {:.3g} points/s  {:.0f} s left", report.step, report.time, report.end_time,
                                       report.time_step, rate, done > 0 ? spent * (1 - done) / done : 0.0);
  if (terminal) {
    fmt::print(stderr, "\r\033[K{}", line);
    line_open_ = !end;
    if (end) std::fputc('\n', stderr);
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
}

}  // namespace perikit
