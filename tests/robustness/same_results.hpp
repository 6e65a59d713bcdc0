#pragma once
/// What runs leave that were stopped and went on, beside what a run without a stop leaves.

#include <chrono>
#include <cmath>
#include <csignal>
#include <random>
#include <thread>

#include "robustness/desk.hpp"

namespace perikit::test {

/// The plate with frames, history and checkpoints that fall on different steps.
inline std::string long_plate() {
  return replaced(replaced(plate, "end_time = 1.0", "end_time = 6.0"), "frames = 5\nhistory_every = 1",
                  "every = 23\nhistory_every = 3\ncheckpoint_every = 7");
}

inline void check_same_results(const Desk& desk, const std::string& folder, const std::string& whole) {
  const std::vector<Frame> frames = read_frames(desk.path(folder)), expected = read_frames(desk.path(whole));
  REQUIRE(frames.size() == expected.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const bool same = frames[k] == expected[k],
               linked = read_frame(desk.path(folder + "/results.h5"), fmt::format("/frames/{:08}", k)) == expected[k];
    CHECK_MESSAGE(same, "frame ", k, " differs");
    CHECK_MESSAGE(linked, "results.h5 does not show frame ", k);
    const std::string file = fmt::format("/frames/{:08}.h5", k);
    CHECK_MESSAGE(desk.text(folder + file) == desk.text(whole + file), "frame ", k, " differs in its bytes");
  }
  for (const std::string file : {"/history.csv", "/results.xdmf", "/results.h5", "/reference.h5", "/scene.toml"}) {
    const bool same = desk.text(folder + file) == desk.text(whole + file);
    CHECK_MESSAGE(same, file, " differs");
  }
}

inline int wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

/// Runs scene.toml with --resume into `folder` and kills it after a random time, later and later, until it comes to its end.
/// first: the longest time to the first kill [ms]. Returns the kills.
inline int run_with_kills(const Desk& desk, const std::string& folder, std::mt19937& random, int first = 80) {
  int kills = 0, status = -1;
  while (status != 0) {
    REQUIRE_MESSAGE(kills < 100, "the run does not get on");
    const pid_t child = desk.start({"run", "scene.toml", "--resume", "-o", folder});
    // However slow the machine and the build are, the run gets through in the end.
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % static_cast<unsigned>(first * std::pow(1.1, kills))));
    kill(child, SIGKILL);
    status = wait_for(child);
    if (WIFSIGNALED(status))
      ++kills;
    else
      REQUIRE_MESSAGE(status == 0, "a resumed run failed with status ", WEXITSTATUS(status));
  }
  return kills;
}

/// Starts scene.toml with --resume into `folder`, sends `signal` once history.csv has `rows` more rows, and returns the exit
/// status.
inline int stop_after(const Desk& desk, const std::string& folder, std::size_t rows, int signal) {
  const pid_t child = desk.start({"run", "scene.toml", "--resume", "-o", folder});
  const auto start = std::chrono::steady_clock::now();
  const auto length = [&] { return lines(desk.text(folder + "/history.csv")).size(); };
  const std::size_t before = length();
  while (length() < before + rows && std::chrono::steady_clock::now() - start < std::chrono::seconds(60))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  kill(child, signal);
  const int status = wait_for(child);
  REQUIRE(WIFEXITED(status));
  return WEXITSTATUS(status);
}

}  // namespace perikit::test
