/// The command line: perikit run | check | study | plot | bench | new | contract | list | describe.

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/run/simulation.hpp"

namespace {

/// The first signal ends the run after its step; a second one ends the program at once.
void stop(int signal) {
  perikit::request_stop();
  std::signal(signal, SIG_DFL);
}

using namespace perikit;

/// One message and one status for all ranks. What all of them meet rank 0 tells, and ends the others before they tell it again;
/// what one of them meets alone, it tells after a while.
int end(Communicator* ranks, int rank, int status, const std::string& message) {
  if (ranks && rank > 0 && sleep(4) > 0) std::_Exit(status);   // a signal: rank 0 has told it, and ends the others
  if (ranks || rank == 0) fmt::print(stderr, "{}\n", message);
  std::fflush(nullptr);
  if (ranks) ranks->abort(status);
  return status;
}

/// Reads the command line; of several ranks rank 0 alone speaks.
std::optional<int> read_command_line(int argc, char** argv, int rank, app::Options& options) {
  if (rank == 0) return app::read_command_line(argc, argv, options);
  const int out = dup(STDOUT_FILENO), err = dup(STDERR_FILENO), nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  const std::optional<int> status = app::read_command_line(argc, argv, options);
  std::fflush(nullptr);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  for (const int file : {out, err, nowhere}) close(file);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  // Waiting threads must sleep: spinning ones make a busy machine several times slower. The runtime reads this when it starts,
  // which is before main; so the program starts itself again once.
  if (!std::getenv("OMP_WAIT_POLICY")) {
    setenv("OMP_WAIT_POLICY", "passive", 1);
    execv("/proc/self/exe", argv);
  }
  app::Options options;
  const Launch launch = find_launch();
  if (const std::optional<int> status = read_command_line(argc, argv, launch.rank, options)) return *status;
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is then an error of the write, with a message
  std::unique_ptr<Communicator> ranks;
  std::optional<CommunicatorScope> scope;
  const auto end_with = [&](int status, const std::string& message) { return end(ranks.get(), launch.rank, status, message); };
  try {
    if (launch.size > 1 && options.command != app::run)
      throw InputError(
          fmt::format("found {} processes ({}); allowed: one, but for `perikit run`, which shares out a scene among them",
                      launch.size, launch.variable));
    ranks = join_ranks(launch);
    if (ranks) scope.emplace(*ranks);
    options.command(options);
    return app::done;
  } catch (const InputError& e) {
    return end_with(app::input_refused, e.what());
  } catch (const RunError& e) {
    return end_with(app::run_failed, fmt::format("the run failed: {}", e.what()));
  } catch (const std::bad_alloc&) {
    return end_with(app::run_failed, "the run failed: not enough memory");
  } catch (const std::exception& e) {
    return end_with(app::run_failed, fmt::format("internal error: {}", e.what()));
  }
}
