/// The command line: perikit run | check | study | plot | bench | new | contract | list | describe.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "commands.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/run/simulation.hpp"

namespace {

enum Exit { done = 0, run_failed = 1, input_refused = 2 };

/// The first signal ends the run after its step; a second one ends the program at once.
void stop(int signal) {
  perikit::request_stop();
  std::signal(signal, SIG_DFL);
}

/// The message of the parser, and where it says no more than that a word is missing, which command was meant.
int refuse(const CLI::App& app, const CLI::ParseError& error, const std::string& word) {
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
  if (std::ranges::find(commands, word) == commands.end() && !word.starts_with('-')) {
    fmt::print(stderr, "found the unknown command '{}'; allowed: {}{}\n", word, fmt::join(commands, ", "), perikit::did_you_mean(word, commands));
  } else {
    fmt::print(stderr, "{}\nHelp: perikit {}--help\n", error.what(), word.starts_with('-') ? "" : word + " ");
  }
  return input_refused;
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
  CLI::App app{"perikit: runtime-loaded parts for correspondence peridynamics", "perikit"};
  app.set_version_flag("--version", app::version());
  app.require_subcommand(1);
  app::Options options;
  app::add_commands(app, options);
  if (argc < 2) {
    fmt::print(stderr, "{}", app.help());
    return input_refused;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForAllHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForVersion& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    return refuse(app, e, argc > 1 ? argv[1] : "");
  }
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGXFSZ, SIG_IGN);   // a file at its size limit is then an error of the write, with a message
  try {
    options.command(options);
    return done;
  } catch (const InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return input_refused;
  } catch (const RunError& e) {
    fmt::print(stderr, "the run failed: {}\n", e.what());
    return run_failed;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "the run failed: not enough memory\n");
    return run_failed;
  } catch (const std::exception& e) {
    fmt::print(stderr, "internal error: {}\n", e.what());
    return run_failed;
  }
}
