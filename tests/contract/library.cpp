#include "tests/contract/library.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "tests/contract/fixture.hpp"
#include "tests/contract/report.hpp"

namespace perikit::contract {

namespace {

constexpr int no_suite = 3;   ///< exit status of a part's process

int run_part(Kind kind, const std::string& part, int argc, char** argv) {
  subject().parts = {{kind, part}};
  doctest::Context context(argc, argv);
  // A stabilization must also keep the contract of the kinematics that it stabilizes.
  const std::string suites = kind == Kind::stabilization ? "stabilization:*,kinematics:*" : fmt::format("{}:*", name(kind));
  context.addFilter("test-case", suites.c_str());
  context.setOption("reporters", report_name);
  const int status = context.run();
  return cases_run() == 0 ? no_suite : status;
}

/// How a part's process ended, in words; empty: it kept its contract.
std::string verdict(Kind kind, const std::string& part, int argc, char** argv) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) return fmt::format("no process of its own: {}", std::strerror(errno));
  if (child == 0) {
    const int status = run_part(kind, part, argc, argv);
    std::fflush(nullptr);
    ::_exit(status);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(status)) return fmt::format("crashes ({})", ::strsignal(WTERMSIG(status)));
  if (WEXITSTATUS(status) == no_suite) return "has no contract suite in this version";
  return WEXITSTATUS(status) == 0 ? "" : "breaks its contract";
}

}  // namespace

int run_library(const std::filesystem::path& library, int argc, char** argv) {
  std::string summary;
  bool kept = true;
  for (const auto& [kind, part] : subject().registry.parts_of(library)) {
    fmt::print("{}/{}\n", name(kind), part);
    const std::string fault = verdict(kind, part, argc, argv);
    summary += fmt::format("{}/{} {}\n", name(kind), part, fault.empty() ? "keeps its contract" : fault);
    kept = kept && fault.empty();
  }
  fmt::print("\n{}", summary);
  return kept ? 0 : 1;
}

}  // namespace perikit::contract
