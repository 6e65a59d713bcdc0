/// The command line: perikit run | check | study | plot | bench | new | contract | list | describe.

#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "core/messages.hpp"
#include "machine_check.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "run/simulation.hpp"

namespace {

/// The first signal ends the run after its step, or at once before the first one; a second one ends the program at once.
void stop(int signal) {
  if (perikit::NothingToKeep::holds()) {
    constexpr char told[] = "\nstopped by a signal during the set-up; nothing was written\n";
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, told, sizeof told - 1);
    ::_exit(perikit::app::run_failed);
  }
  perikit::request_stop();
  std::signal(signal, SIG_DFL);
}

using namespace perikit;

/// Where a standard stream is closed, the next file that is opened would take its place, and messages would go into results.
void open_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(descriptor, F_GETFD) < 0)
      ::open("/dev/null", descriptor == STDIN_FILENO ? O_RDONLY : O_WRONLY);  // takes the lowest number that is free
}

/// A library may end the program where it gets no memory or no thread (the runtime of OpenMP does), and the end of another may then wait for
/// ever for threads of its own (OpenBLAS). So the program ends here, before the ends of libraries: whatever it wrote is complete.
void end_at_once(int status, void*) {
  std::fflush(nullptr);
  ::_exit(status);
}

/// One message and one status for all ranks. What all of them meet rank 0 tells, and ends the others before they tell it again;
/// what one of them meets alone, it tells after a while.
int end(Communicator* ranks, int rank, int status, const std::string& message) {
  if (ranks && rank > 0 && sleep(4) > 0) std::_Exit(status);  // a signal: rank 0 has told it, and ends the others
  if (ranks || rank == 0) tell(message + "\n");
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

/// Every way in which a command can end.
int status_of(int argc, char** argv) {
  const Launch launch = find_launch();
  std::unique_ptr<Communicator> ranks;
  std::optional<CommunicatorScope> scope;
  const auto end_with = [&](int status, const std::string& message) { return end(ranks.get(), launch.rank, status, message); };
  try {
    app::Options options;
    if (const std::optional<int> status = read_command_line(argc, argv, launch.rank, options)) return *status;
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
  } catch (const app::WrongBuild& e) {
    return end_with(app::run_failed, e.what());
  } catch (const std::bad_alloc&) {
    return end_with(app::run_failed, "the run failed: not enough memory");
  } catch (const std::exception& e) {
    if (!ranks && std::ferror(stdout)) return app::run_failed;  // said by the caller
    return end_with(app::run_failed, fmt::format("internal error: {}", e.what()));
  } catch (...) {
    return end_with(app::run_failed, "internal error: something that is no std::exception was thrown; a library of parts may have done so");
  }
}

/// The first library of parts on the stack.
std::string library_on_stack() {
  std::array<void*, 64> frames;
  const int count = ::backtrace(frames.data(), static_cast<int>(frames.size()));
  for (int k = 0; k < count; ++k) {
    Dl_info info{};
    if (::dladdr(frames[static_cast<std::size_t>(k)], &info) == 0 || !info.dli_fname) continue;
    void* const library = ::dlopen(info.dli_fname, RTLD_NOW | RTLD_NOLOAD);  // null for the program itself
    if (library && ::dlsym(library, "perikit_register")) return info.dli_fname;
  }
  return {};
}

/// What a part throws where it may not (a law in the middle of a loop over points, say) ends the program; it is named here.
[[noreturn]] void end_of_exception() noexcept {
  const std::string library = library_on_stack();
  std::string what = "something that is no std::exception";
  if (const std::exception_ptr thrown = std::current_exception()) {
    try {
      std::rethrow_exception(thrown);
    } catch (const std::exception& error) {
      what = error.what();
    } catch (...) {
    }
  }
  perikit::tell(fmt::format("the run failed: {} threw where nothing may be thrown: {}\n", library.empty() ? "a part or perikit itself" : library, what));
  ::_exit(perikit::app::run_failed);
}

/// What was printed has to arrive: a full disk behind standard output is a failure.
int flushed(int status) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return status;
  perikit::tell("standard output cannot be written\n");
  return status == perikit::app::done ? perikit::app::run_failed : status;
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  // Waiting threads must sleep: spinning ones make a busy machine several times slower. They look for more work for ten microseconds or so before
  // that, since waking takes as long. The runtime reads this when it starts, which is before main; so the program starts itself again once.
  if (!std::getenv("OMP_WAIT_POLICY")) {
    setenv("OMP_WAIT_POLICY", "passive", 1);
    setenv("GOMP_SPINCOUNT", "1000", 0);
    execv("/proc/self/exe", argv);
  }
  prctl(PR_SET_NAME, "perikit");   // the name for `top` and `pkill`: started again it would be "exe"
  // Large arrays go back to the system when they are freed. Without a word the allocator keeps those that are as large as any freed before, up to
  // 32 MiB each: a run of 2e5 points took a quarter more, and how much hung on the order of what came before.
  mallopt(M_MMAP_THRESHOLD, 1 << 18);
  // Factorizations have threads of ours or none; those of OpenBLAS would only take memory, 128 MiB each.
  setenv("OPENBLAS_NUM_THREADS", "1", 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)   // these look for leaks at the end
  ::on_exit(end_at_once, nullptr);
#endif
  std::set_terminate(end_of_exception);
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is then an error of the write, with a message
  return flushed(status_of(argc, argv));
}
