// One run of a study, here or in a process of its own.
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <optional>
#include <ctime>
#include <new>
#include <span>
#include <sstream>

#include "files/atomic_file.hpp"
#include "run/simulation.hpp"
#include "study/study.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

RunOutcome failed(const std::string& reason) {
  return {"failed", reason, {}};
}

/// "status\nmeasure value\n...\n\nreason" and a null byte, which says that nothing is missing.
std::string packed(const RunOutcome& outcome) {
  std::string text = outcome.status + '\n';
  for (const auto& [name, value] : outcome.measures) text += fmt::format("{} {:.17g}\n", name, value);
  return text + '\n' + outcome.reason + '\0';
}

RunOutcome unpacked(std::string text) {
  text.pop_back();
  const std::size_t reason = text.find("\n\n");
  std::optional<NothingToKeep> set_up_alone(std::in_place);
  RunOutcome outcome;
  std::istringstream lines(text.substr(0, reason));
  std::getline(lines, outcome.status);
  std::string name;
  for (double value = 0; lines >> name >> value;) outcome.measures[name] = value;
  outcome.reason = text.substr(reason + 2);
  return outcome;
}

constexpr const char* outcome_file = "outcome.txt";

/// What the child writes until it ends; a stop that reaches this process alone is handed on.
std::string received(int pipe, pid_t child) {
  std::string text;
  std::array<char, 4096> buffer;
  for (;;) {
    pollfd ready{pipe, POLLIN, 0};
    if (::poll(&ready, 1, -1) < 0) {
      if (errno != EINTR) return text;
      if (stop_requested()) ::kill(child, SIGTERM);
      continue;
    }
    const ssize_t count = ::read(pipe, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

const std::vector<std::string>& run_measures() {
  static const std::vector<std::string> names{"run_time", "cpu_time", "set_up_time", "steps", "points", "bonds", "memory"};
  return names;
}

RunOutcome run_here(const Scene& scene, const PartFactory& parts, const fs::path& folder, bool force) {
  using clock = std::chrono::steady_clock;
  const auto seconds = [](clock::duration duration) { return std::chrono::duration<double>(duration).count(); };
  RunOutcome outcome{"done", "", {}};
  std::optional<NothingToKeep> set_up_alone(std::in_place);
  try {
    const auto start = clock::now();
    Simulation simulation(scene, parts);
    outcome.measures["set_up_time"] = seconds(clock::now() - start);
    BodyProblem& problem = simulation.problem();
    outcome.measures["points"] = static_cast<double>(problem.points().size_on_all_ranks());
    outcome.measures["bonds"] = static_cast<double>(problem.report().bonds);
    outcome.measures["memory"] = static_cast<double>(problem.bytes());
    const std::string summary = simulation.summary();
    simulation.refuse_memory();
    set_up_alone.reset();
    RunRecorder recorder(simulation, folder, false, RunStart::fresh, {}, force);
    recorder.log(summary);
    const auto running = clock::now();
    const std::clock_t processor = std::clock();
    try {
      simulation.run(recorder);
      recorder.finish();
    } catch (const RunError& error) {
      recorder.log(fmt::format("failed: {}", error.what()));
      throw;
    }
    outcome.measures["run_time"] = seconds(clock::now() - running);
    outcome.measures["cpu_time"] = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
    outcome.measures["steps"] = static_cast<double>(problem.state().step);
    if (recorder.cancelled()) return failed("stopped by a signal");
  } catch (const InputError& error) {
    return {"refused", error.what(), {}};
  } catch (const std::bad_alloc&) {
    return failed("not enough memory");
  } catch (const std::exception& error) {
    return failed(error.what());
  } catch (...) {
    return failed("a library of parts threw something that is no std::exception");
  }
  return outcome;
}

void keep_outcome(const fs::path& folder, const RunOutcome& outcome) {
  make_folder(folder);
  write_file_atomically(folder / outcome_file, packed(outcome));
}

std::optional<RunOutcome> kept_outcome(const fs::path& folder) {
  const std::string text = read_text(folder / outcome_file);
  if (text.empty() || text.back() != '\0') return std::nullopt;
  return unpacked(text);
}

RunOutcome run_in_child(const Scene& scene, const PartFactory& parts, const fs::path& folder, bool force) {
  int ends[2];
  if (::pipe(ends) != 0) return failed(fmt::format("no pipe to a process of its own: {}", std::strerror(errno)));
  Descriptor reading(ends[0]), writing(ends[1]);
  const pid_t child = ::fork();
  if (child < 0) return failed(fmt::format("no process of its own: {}", std::strerror(errno)));
  if (child == 0) {
    const std::string text = packed(run_here(scene, parts, folder, force));
    ::_exit(write_all(writing.get(), std::as_bytes(std::span(text))) == 0 ? 0 : 1);
  }
  writing = Descriptor();
  const std::string text = received(reading.get(), child);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (!text.empty() && text.back() == '\0') return unpacked(text);
  if (WIFSIGNALED(status)) return failed(fmt::format("its process was killed ({})", ::strsignal(WTERMSIG(status))));
  return failed(fmt::format("its process ended early (exit status {})", WEXITSTATUS(status)));
}

}  // namespace perikit
