/// The command line: perikit run | check | study | plot | bench | new | contract | list | describe.

#include <fmt/core.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <new>

#include "command_line.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/run/simulation.hpp"

namespace {

/// The first signal ends the run after its step; a second one ends the program at once.
void stop(int signal) {
  perikit::request_stop();
  std::signal(signal, SIG_DFL);
}

}  // namespace

int main(int argc, char** argv) {
  // Waiting threads must sleep: spinning ones make a busy machine several times slower. The runtime reads this when it starts,
  // which is before main; so the program starts itself again once.
  if (!std::getenv("OMP_WAIT_POLICY")) {
    setenv("OMP_WAIT_POLICY", "passive", 1);
    execv("/proc/self/exe", argv);
  }
  using namespace perikit;
  app::Options options;
  if (const std::optional<int> status = app::read_command_line(argc, argv, options)) return *status;
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGXFSZ, SIG_IGN);   // a file at its size limit is then an error of the write, with a message
  try {
    options.command(options);
    return app::done;
  } catch (const InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return app::input_refused;
  } catch (const RunError& e) {
    fmt::print(stderr, "the run failed: {}\n", e.what());
    return app::run_failed;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "the run failed: not enough memory\n");
    return app::run_failed;
  } catch (const std::exception& e) {
    fmt::print(stderr, "internal error: {}\n", e.what());
    return app::run_failed;
  }
}
