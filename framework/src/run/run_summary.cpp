#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>

#include <algorithm>

#include "core/ranks/numbered_rows.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/warnings.hpp"
#include "run/simulation.hpp"
#include "warnings/small_strains.hpp"

namespace perikit {

namespace {

double peak_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

/// What was left out because it was at rest, in words; empty where nothing was.
std::string quiet_summary(const RestingCounts& counts, bool dynamic) {
  if (counts.quiet == 0) return {};
  return fmt::format("quiet blocks  {} of {} blocks of points left out of force evaluations ({:.2f} %): {}\n", counts.quiet, counts.blocks,
                     100.0 * static_cast<double>(counts.quiet) / static_cast<double>(counts.blocks), dynamic ? "no wave had reached them" : "nothing had moved there yet");
}

}  // namespace

double RunRecorder::bytes_of_pieces(std::size_t points_of_all_ranks) noexcept {
  return 60.0 * static_cast<double>(std::min(points_of_all_ranks, rows_of_piece));
}

std::string RunRecorder::closing(const TimesBefore& before) const {
  BodyProblem& problem = simulation_.problem();
  const auto now = std::chrono::steady_clock::now();
  const double spent = std::chrono::duration<double>(now - start_).count(), all = std::chrono::duration<double>(now - before.begin).count(), steps_time = std::max(0.0, spent - output_seconds_);
  const auto steps = static_cast<double>(problem.state().step - first_step_), points = static_cast<double>(problem.points().size_on_all_ranks());
  std::string text = problem.fracture_summary() + quiet_summary(problem.report().resting, simulation_.dynamic());
  text += fmt::format("time          {:.2f} s in all: {:.2f} s set-up, {:.2f} s plan, {:.2f} s steps, {:.2f} s output ({} frames, {} rows of history, {} checkpoints)\n", all,
                      before.set_up, before.plan, steps_time, output_seconds_, frames_written_, rows_written_, checkpoints_written_);
  if (before.set_up + before.plan >= 1) text += fmt::format("set-up        {}\n", simulation_.set_up().summary());
  if (steps > 0) {
    text += fmt::format("speed         {:.0f} steps of {:.0f} points, {:.3g} points/s ({:.3g} ns a point and step, {} thread{})\n", steps, points,
                        steps * points / std::max(steps_time, 1e-9), steps_time / (steps * points) * 1e9, thread_count(), thread_count() > 1 ? "s" : "");
  }
  if (problem.ghosts())
    text += fmt::format("exchange      {:.2f} s spent in waiting for other ranks, by the one that waited longest\n",
                        communicator().largest(problem.ghosts()->waited()));
  const double arrays = communicator().largest(static_cast<double>(problem.bytes())), peak = communicator().largest(peak_bytes());
  text += fmt::format("memory        {:.3g} MB of arrays, {:.3g} MB at most{}\n", arrays / 1e6, peak / 1e6,
                      communicator().size() > 1 ? ", on the rank with most" : "");
  const Energies& e = problem.state().energies;
  const std::string by_laws = problem.dissipates() ? fmt::format(" ({:.6g} J by laws)", e.dissipated_by_laws) : "";
  text += fmt::format("energy        strain {:.6g} J, kinetic {:.6g} J, dissipated {:.6g} J{}, work put in {:.6g} J", e.strain,
                      e.kinetic, e.dissipated, by_laws, e.external_work);
  if (EnergyBalance last{.initial = done_.energies.initial}; problem.state().step > 0) {
    last.add(e, simulation_.dynamic() ? energy_of_load_kick(problem, time_step_) : 0.0);
    text += fmt::format("; balance off by {:.2g} of the largest", last.share());
  }
  std::vector<std::string> warnings = warnings_;
  if (const std::string warning = energy_warning(); !warning.empty()) warnings.push_back(warning);
  if (const std::string warning = simulation_.small_strains().closing(); !warning.empty()) warnings.push_back(warning);
  warnings = without_silenced(std::move(warnings), simulation_.scene().silence);
  text += fmt::format("\nwarnings      {}\n",
                      warnings.empty() ? "none" : fmt::format("{}\n  {}", warnings.size(), fmt::join(warnings, "\n  ")));
  text += fmt::format("results       {} frames in {}", frames(), folder_.string());
  return text;
}

}  // namespace perikit
